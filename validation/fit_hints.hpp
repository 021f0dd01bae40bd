// Signs that a model has too many parameters or too few, in words.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/validation/common_factors.hpp>
#include <blockid/validation/residual_tests.hpp>

#include <complex>
#include <string>
#include <vector>

namespace blockid {

/// Zeros and poles of one linear block in the z plane.
struct FilterRoots {
  std::string name;
  std::vector<std::complex<double>> zeros;
  std::vector<std::complex<double>> poles;
};

/// A zero and a pole that nearly cancel: what taking both out changes of the filter's response,
///
///     max over omega of |(1 - z e^{-j omega}) / (1 - p e^{-j omega}) - 1| <= |p - z| / (1 - |p|).
struct CancellingPair {
  std::complex<double> zero;
  std::complex<double> pole;
  double change = 0.0;
};

/// Pairs that change the response by less than `largest_change`, each root in one pair at most, the closest first.
/// Unstable poles are left out; of conjugate pairs, the upper one is given.
std::vector<CancellingPair> cancelling_pairs(const FilterRoots& roots, double largest_change = 0.05);

/// Errors on the data that a model was fitted to and on others.
struct ErrorComparison {
  double ratio = 1.0;     ///< of the deviations, other over training
  double expected = 1.0;  ///< sqrt((1 + P / n) / (1 - P / n)): what P fitted parameters explain
  double p_value = 1.0;   ///< of so large a ratio by chance
};

/// Compares two sets of residual tests of one model; `training` with its parameters fitted there.
///
/// ratio^2 of the deviations with their degrees of freedom is F distributed for normal noise, taken as normal in its
/// logarithm: variance 2 / n_1 + 2 / n_2 with effective samples.
ErrorComparison compare_errors(const ResidualTests& training, const ResidualTests& test);

/// What can be known of a fitted model.
struct OverFitEvidence {
  Model model;                                  ///< with its standard deviations, where known
  std::vector<FilterRoots> filters;             ///< of its linear blocks
  std::vector<EstimatedFilter> estimated = {};  ///< of those whose coefficients have a known covariance
  std::vector<std::string> undetermined;        ///< parameters in directions that the data do not determine
  const ResidualTests* training = nullptr;
  const ResidualTests* test = nullptr;
};

/// A sentence for each sign of too many parameters: undetermined directions, standard deviations above their values,
/// roots that nearly cancel or that the data do not tell apart, last coefficients that may be zero, a test error far
/// above the training error.
std::vector<std::string> over_fit_hints(const OverFitEvidence& evidence);

/// A sentence for each failed test: what the model has missed.
std::vector<std::string> under_fit_hints(const ResidualTests& tests);

}  // namespace blockid
