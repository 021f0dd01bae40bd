// All that an identification with a model of the noise has brought, its residual tests and its report.
#pragma once

#include <blockid/cli/evaluation.hpp>
#include <blockid/cli/judgement.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/options.hpp>
#include <blockid/init/polynomial_starts.hpp>

#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// Figures of one horizon.
struct LinearScore {
  std::string name;
  Metrics train;
  std::optional<Metrics> test;
};

struct LinearOutcome {
  PolynomialIdentification found;
  std::vector<LinearScore> scores;
  bool finite = true;
  std::vector<Range> train_ranges;
  std::vector<Range> test_ranges;
  /// Simulations, which the report shows.
  Evaluation train;
  std::optional<Evaluation> test;
  /// None where the tests were refused; the reason then.
  std::optional<Judgement> judgement;
  std::string not_judged;
  std::vector<std::string> warnings;
};

/// Tests of the prediction errors of the test data, where there are any, with the covariance of the parameters from the
/// training data; otherwise of the training data. White errors mean that the model of the noise is right, errors
/// without a trace of the input that the path from the input is. Throws Error as residual_tests() does.
Judgement judge(const PolynomialFit& fit, const DataSet& training, const DataSet& test,
                const PredictionOptions& prediction);

/// What is doubtful about a fit: roots that left the circle, coefficients that are not determined, no convergence.
std::vector<std::string> warnings_of(const PolynomialFit& fit);

/// Of structures with F: a warning when A of a least-squares model with some more coefficients has a root outside the
/// circle, by more than 4 standard deviations of its modulus; empty otherwise. Such a system is recorded in closed
/// loop, and an F with all roots inside is a wrong model of it.
std::string warning_of_unstable_system(const PolynomialOrders& orders, const DataSet& data,
                                       const PredictionOptions& prediction);

/// Whether the input excites what B, and F where there is one, need: A and the model of the noise are told by the
/// noise. Means are taken off and tell nothing. A warning, or empty.
std::string warning_of_excitation(const PolynomialOrders& orders, const DataSet& data);

/// The report as one HTML file.
std::string linear_report(const LinearCommand& command, const LinearOutcome& outcome);

}  // namespace blockid::cli
