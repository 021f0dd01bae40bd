// What tables, JSON and reports say of a continuous-time model, however it was estimated.
#pragma once

#include <blockid/cli/report/html.hpp>
#include <blockid/estimators/continuous_model.hpp>
#include <blockid/estimators/excitation.hpp>
#include <blockid/estimators/trend_fit.hpp>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <complex>
#include <iosfwd>
#include <numbers>
#include <string>
#include <vector>

namespace blockid::cli {

/// rad/s of 1 Hz.
inline constexpr double kTurn = 2.0 * std::numbers::pi;

/// A coefficient of a power of s: "a1", "b0". The deviation is not a number when unknown.
struct Coefficient {
  std::string name;
  double value = 0.0;
  double standard_deviation = 0.0;
};

/// In rad/s; deviations of real and imaginary part, not a number when unknown.
struct ContinuousRoot {
  std::complex<double> value;
  double real_deviation = 0.0;
  double imaginary_deviation = 0.0;
};

/// G(s) = B(s) / A(s), A monic.
struct ContinuousSummary {
  /// A without its leading one, then B, powers descending; empty when they overflow.
  std::vector<Coefficient> coefficients;
  std::vector<ContinuousRoot> poles;
  std::vector<std::complex<double>> zeros;
  /// G(0); infinite with an integrator.
  double dc_gain = 0.0;
  bool stable = true;
  /// Why a part is missing, a sentence each.
  std::vector<std::string> notes;
};

/// covariance: (P, P) of [a, b] of the model, or empty when unknown.
ContinuousSummary summary_of(const ContinuousTransferFunction& model, const Eigen::MatrixXd& covariance);
ContinuousSummary summary_of(const TrendFit& fit);

/// Coefficients, poles and zeros as tables.
void print_summary(std::ostream& stream, const ContinuousSummary& summary);
void add_summary(HtmlPage& page, const ContinuousSummary& summary);

/// `frequencies`, `equations`, `coefficients`, and whether they are `enough`.
nlohmann::ordered_json excitation_json(const Excitation& excitation, Index coefficients);

/// Adds `coefficients`, `poles`, `zeros`, `dc_gain`, `stable`.
void add_summary(nlohmann::ordered_json& result, const ContinuousSummary& summary);

}  // namespace blockid::cli
