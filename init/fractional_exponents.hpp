// Exponents of known poles and zeros from Taylor coefficients, in closed form at any order.
#pragma once

#include <blockid/init/root_groups.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid {

/// Roots that enter the coefficients alike: only sum alpha - sum beta over them is determined.
struct SharedRoot {
  /// Indices of the poles and zeros; of a root at the origin nothing is determined.
  std::vector<Index> poles;
  std::vector<Index> zeros;
  /// sum alpha - sum beta.
  double difference = 0.0;
};

struct FractionalExponents {
  Eigen::VectorXd alpha;
  Eigen::VectorXd beta;
  /// Root mean square of the linearised error of the coefficients, relative to that of the coefficients A_1 .. A_m.
  double residual = 0.0;
  /// Ratio of the extreme singular values of the system with columns of unit norm; infinite when rank < unknowns.
  double condition = 1.0;
  /// Distinct roots, and how many combinations of their exponents the coefficients determine.
  Index unknowns = 0;
  Index rank = 0;
  /// Repeated roots, cancelling ones and those at the origin.
  std::vector<SharedRoot> shared;

  /// True when every exponent is determined.
  bool unique() const { return shared.empty() && rank == unknowns; }
};

struct ExponentOptions {
  /// Errors of A_k are taken to fall as error_decay^k. 0: the magnitude of the largest root, right for coefficients
  /// computed in floating point; 1: equal errors, right for measured ones.
  double error_decay = 0.0;
  /// Roots nearer than this times the largest one are the same root.
  double merge_distance = 1e-7;
  /// Directions below this times the largest are left out.
  double rank_tolerance = 1e-12;
};

/// (alpha, beta) of prod (1 - z_j x)^beta_j / prod (1 - p_i x)^alpha_i = A_0 + A_1 x + ... + A_m x^m + ...
///
/// s_k = sum_i alpha_i P_k(i) - sum_j beta_j Z_k(j) with the power sums s of the coefficients (Newton's identities) is
/// linear in the exponents. x is scaled by the largest root, the rows by dA/ds so that their errors are those of the
/// coefficients, the columns to unit norm; rank-revealing QR solves for the deviations from 1/2, so that what is not
/// determined stays there. For three roots this is (38) of Giordano and Sjoberg 2015 with the sign of beta_1 corrected.
///
/// coefficients: (m + 1,) A_0 .. A_m. Throws Error for A_0 = 0, for coefficients fewer than distinct roots and for
/// infinite roots.
FractionalExponents fractional_exponents(const Eigen::VectorXd& coefficients, const std::vector<RootGroup>& poles,
                                         const std::vector<RootGroup>& zeros, const ExponentOptions& options = {});

/// What is not determined, in words; "" when everything is.
std::string undetermined_text(const FractionalExponents& exponents, const std::vector<RootGroup>& poles,
                              const std::vector<RootGroup>& zeros);

}  // namespace blockid
