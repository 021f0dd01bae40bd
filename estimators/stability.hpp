// Poles of a chain's rational filters: whether they lie inside the unit circle, and models whose poles do.
#pragma once

#include <blockid/blocks/model.hpp>

#include <string>
#include <vector>

namespace blockid {

/// Whether all poles of the rational filters of the chain, nested ones included, lie inside the unit circle.
///
/// Records of one period hide a pole on or outside it whose effect a zero nearby cancels; what is simulated longer than
/// the record grows without bound.
bool is_stable(const Model& model);

/// Names of the denominator coefficients of the filters that have a pole on or outside the circle.
std::vector<std::string> unstable_denominators(const Model& model);

/// The model with every pole p outside the circle at 1/conj(p) and its numerator divided by |p|, which keeps |G| at all
/// frequencies; a pole that this leaves at a radius above 0.999 comes to 0.999. The standard deviations are dropped.
Model with_reflected_poles(const Model& model);

}  // namespace blockid
