// Knots where a curve bends.
#pragma once

#include <blockid/blocks/knots.hpp>

#include <functional>
#include <span>
#include <vector>

namespace blockid {

/// `count` strictly increasing knots for the curve f over the signal v (N,): half of them as KnotPlacement::mixed lays
/// them, the other half at quantiles of the density
///
///   |f''(x)|^(2/5) p(x)^(1/5)
///
/// over the range of v, p the density of v: it makes the weighted error of interpolation by straight lines the same in
/// every interval (de Boor 1978, chapter XII). Cubic pieces would ask for the fourth derivative, of which a curve that
/// is a cubic spline itself says nothing. f is evaluated on a grid within the range; a twentieth of the mean density is
/// added everywhere, and a straight f gets its half uniformly.
///
/// Neighbours are at least range / (100 (count - 1)) apart; knots saved by that halve the widest intervals.
/// Throws Error for the same counts and signals as place_knots(), and for an f that is not finite.
std::vector<double> curvature_knots(std::span<const double> v, const std::function<double(double)>& f, Index count);

}  // namespace blockid
