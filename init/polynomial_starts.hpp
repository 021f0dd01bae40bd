// From data alone to linear models with a model of their noise: ARX, ARMAX, output error, Box-Jenkins.
#pragma once

#include <blockid/data/data_set.hpp>
#include <blockid/estimators/polynomial_fit.hpp>

#include <string>
#include <vector>

namespace blockid {

/// A model to start a prediction-error fit from.
struct PolynomialStart {
  PolynomialModel model;
  /// Where it came from, in words.
  std::string how;
};

/// Starts of A y = q^-nk B/F u + C/D e by linear regressions, all with C, D and F inside the circle:
///
/// 1. na = 0: B/F by Steiglitz and McBride's iteration on the data, and on data whitened by a long ARX model, whose A
///    stands for the inverse of any noise model;
/// 2. na > 0: A and B by least squares, with the residuals of a long ARX model for the past noise when nc > 0, nd = 0;
/// 3. C/D from what the path from u leaves: residuals of a long AR model for its past noise, then least squares.
///
/// u_mean and y_mean are the means of the data. Throws Error for data that do not pass check(), a constant input, fewer
/// samples than parameters, and for na > 0 together with nf > 0, of which no regression can tell the poles apart.
/// Sources: Steiglitz and McBride 1965; Zhu and Hjalmarsson 2016; Hannan and Rissanen 1982.
std::vector<PolynomialStart> polynomial_starts(const DataSet& data, const PolynomialOrders& orders,
                                               const PredictionOptions& prediction);

/// What became of one start.
struct PolynomialTrial {
  std::string how;
  /// Root mean square prediction errors before and after the fit.
  double start_rmse = 0.0;
  double rmse = 0.0;
  FitStatus status = FitStatus::diverged;
  int iterations = 0;
};

struct PolynomialIdentification {
  PolynomialFit fit;
  /// Where the best fit started.
  std::string how;
  /// One a start, in the order in which they were tried.
  std::vector<PolynomialTrial> trials;
};

/// The best of the fits from all starts. A fit whose C left the circle is tried again with the roots reflected; models
/// whose predictor is stable come before those whose is not.
///
/// Throws Error for what polynomial_starts() and refit() refuse.
PolynomialIdentification identify_polynomial(const DataSet& data, const PolynomialOrders& orders,
                                             const PolynomialFitOptions& options = {});

}  // namespace blockid
