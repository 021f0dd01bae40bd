// Figures 2 to 5 of Giordano and Sjoberg 2015, and two that the paper does not have.
#pragma once

#include <blockid/cli/reproduction.hpp>

#include <blockid/blocks/model.hpp>
#include <blockid/init/bla.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid::cli {

/// A step of the procedure: its error as a signal.
struct StepError {
  std::string name;
  /// Measured - simulated, (N,).
  Eigen::VectorXd error;
};

/// What the pictures show.
struct GiordanoPictures {
  /// Of problems::giordano_sjoberg(), filters of gain 1 at frequency zero.
  Model truth;
  /// (N,) that drove it.
  Eigen::VectorXd u;
  BestLinearApproximation bla;
  /// Of the poles of the best linear approximation, then of its zeros: the share of each in G1.
  Eigen::VectorXd exponents;
  Model refitted;
  /// Figure 4: root mean square error / noise of the steps 1 to 5, from the best linear approximation and from the true
  /// product of the filters, (5,) each.
  Eigen::VectorXd from_bla;
  Eigen::VectorXd from_product;
  std::vector<StepError> errors;
  double noise = 0.0;
};

std::vector<Picture> giordano2015_pictures(const GiordanoPictures& shown);

}  // namespace blockid::cli
