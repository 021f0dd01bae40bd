// How a sampled signal is taken to run between its samples.
#pragma once

#include <blockid/blocks/block.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace blockid {

/// A signal between its samples, u(t + s h), 0 <= s < 1:
///
/// | hold           | text           | u(t + s h)                                     | error at w        | lag |
/// |----------------|----------------|------------------------------------------------|-------------------|-----|
/// | zero_order     | `zoh`          | u_t: what a converter puts out                 | O(w h)            | 0   |
/// | first_order    | `foh`          | (1 - s) u_t + s u_{t+1}                        | (w h)^2 / 12      | 0   |
/// | cubic          | `spline3`      | interpolating spline                           | O((w h)^4)        | 19  |
/// | quintic        | `spline5`      | interpolating spline                           | O((w h)^6)        | 31  |
/// | septic         | `spline7`      | interpolating spline                           | O((w h)^8)        | 43  |
/// | band_limited   | `band_limited` | spline of degree 11, near the band-limited one | O((w h)^12)       | 69  |
///
/// h is the sample time. An interpolating spline depends on samples to come. A block truncates that dependence where it
/// falls below 1e-10 and lags by hold_latency() samples; an estimator, which has the whole record, does neither.
/// Splines of rising degree tend to the band-limited (sinc) interpolation (Aldroubi, Unser and Eden 1992).
enum class Hold { zero_order, first_order, cubic, quintic, septic, band_limited };

/// "zoh", "foh", "spline3", ...
std::string to_text(Hold hold);
/// Nothing for an unknown word.
std::optional<Hold> hold_from_text(std::string_view text);
/// All of them, in the order above.
std::vector<Hold> holds();

/// Samples by which a causal block with this hold lags.
Index hold_latency(Hold hold);

/// How a continuous-time block meets its samples.
struct Sampling {
  double sample_time_s = 1.0;
  Hold hold = Hold::first_order;
};

}  // namespace blockid
