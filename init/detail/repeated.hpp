// Candidates that are the same model.
#pragma once

#include <blockid/estimators/candidate.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace blockid::detail {

/// Keeps the first of candidates whose parameters agree to rounding: refits of the others would only take their turn.
inline std::vector<Candidate> without_repeated(std::vector<Candidate> candidates) {
  constexpr double kRounding = 1e-9;
  std::vector<Candidate> kept;
  for (Candidate& candidate : candidates) {
    const Eigen::VectorXd& theta = candidate.model.parameters;
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const Candidate& other) {
      return other.model.parameters.size() == theta.size() && other.model.parameters.isApprox(theta, kRounding);
    });
    if (!known) kept.push_back(std::move(candidate));
  }
  return kept;
}

}  // namespace blockid::detail
