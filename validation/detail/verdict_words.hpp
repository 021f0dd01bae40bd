// What verdicts of one and of several channels check and say alike.
#pragma once

#include <blockid/data/error.hpp>
#include <blockid/validation/verdict.hpp>

#include <Eigen/Core>
#include <cmath>
#include <sstream>
#include <string>

namespace blockid::detail {

/// Of the largest sample of w: v and w are results of filters, exact to some 1e-12 of their size, and the programme
/// resolves 1e-9.
inline constexpr double kSmallestNoise = 1e-7;

/// Numbers with four digits.
template <class... Parts>
std::string words(const Parts&... parts) {
  std::ostringstream text;
  text.precision(4);
  (text << ... << parts);
  return text.str();
}

/// Throws Error for a noise bound that is negative or not finite, an absurd_alpha of 1 or less, a negative memory, and
/// none where a window does not start at rest.
inline void check_verdict_options(double noise_bound, double absurd_alpha, Eigen::Index memory, bool all_from_rest) {
  if (!(noise_bound >= 0.0) || !std::isfinite(noise_bound)) {
    fail("verdict: expected a finite noise bound of at least 0, got ", noise_bound);
  }
  if (!(absurd_alpha > 1.0)) fail("verdict: expected an absurd alpha above 1, got ", absurd_alpha);
  if (memory < 0) fail("verdict: expected a memory of at least 0 samples, got ", memory);
  if (!all_from_rest && memory == 0) {
    fail("verdict: a window that does not start at rest needs the memory of the uncertainty");
  }
}

inline VerdictNote noise_bound_too_small(double absurd_alpha) {
  return {
      VerdictWarning::noise_bound_too_small,
      words("An uncertainty of ", absurd_alpha,
            " does not explain the record either: suspect the noise bound, the controller or the state at the start "
            "before the model.")};
}

inline VerdictNote past_shorter_than_memory(Eigen::Index past, Eigen::Index memory) {
  return {VerdictWarning::past_shorter_than_memory,
          words("The past of ", past, " samples is shorter than the memory of the uncertainty, ", memory,
                " samples: what came before may stand in w, so that nothing is proven.")};
}

}  // namespace blockid::detail
