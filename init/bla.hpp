// Best linear approximation: the linear model that predicts the output best in least squares.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/candidate.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/init/root_groups.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid {

/// Degrees of the linear model and the delay.
struct BlaOrders {
  Index nb = 2;
  Index na = 2;
  Index nk = 0;
};

struct BlaOptions {
  PredictionOptions prediction = {};
  /// Steiglitz-McBride iterations.
  int prefilter_iterations = 20;
  /// Levenberg-Marquardt iterations of the output-error refit.
  int max_iterations = 100;
  bool covariance = false;
  ProgressFunction progress = {};
};

/// y - output_mean = G (u - input_mean) + what is left.
struct BestLinearApproximation {
  /// Rational filter of the deviations from the means.
  Model model;
  double input_mean = 0.0;
  double output_mean = 0.0;
  /// sqrt(sum r^2 / counted samples).
  double rmse = 0.0;
  std::vector<RootGroup> zeros = {};
  std::vector<RootGroup> poles = {};
  /// Which start led here: "ARX" or "Steiglitz-McBride".
  std::string how = {};
  RefitReport refit;
};

/// Equation-error start: argmin_{a,b} sum_t (A(q) y_t - B(q) u_{t-nk})^2, poles reflected into the circle.
/// Returns a rational filter with theta = [b, a]. Rows that touch missing samples are left out.
Model arx(const DataSet& data, const BlaOrders& orders);

/// Steiglitz and McBride 1965: ARX on u/A and y/A with A of the round before; the round of smallest output error.
Model steiglitz_mcbride(const DataSet& data, const BlaOrders& orders, const PredictionOptions& prediction,
                        int iterations);

/// argmin_G sum_t (y_t - output_mean - G (u_t - input_mean))^2 by output-error Levenberg-Marquardt, started at ARX and
/// at Steiglitz-McBride; the better result.
///
/// Throws Error for orders below zero, constant inputs and too few samples.
BestLinearApproximation best_linear_approximation(const DataSet& data, const BlaOrders& orders,
                                                  const BlaOptions& options = {});

/// One line of an order table.
struct BlaScore {
  BlaOrders orders;
  double rmse = 0.0;
  /// Akaike: N ln(rmse^2) + 2 P. Bayes: N ln(rmse^2) + P ln N.
  double aic = 0.0;
  double bic = 0.0;
  /// On the validation data; not a number when there are none.
  double validation_rmse = 0.0;
};

/// Scores of every combination nb = na = 1..max_order and nk = 0..max_delay, in that order. Progress is told once a
/// combination; those left when it cancels have scores that are not numbers.
std::vector<BlaScore> bla_order_table(const DataSet& data, const DataSet& validation, Index max_order, Index max_delay,
                                      const BlaOptions& options = {}, int threads = 1);

}  // namespace blockid
