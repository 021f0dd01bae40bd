// Sampled systems with several inputs and outputs: realisations, responses, feedback that moves their unstable poles.
#pragma once

#include <blockid/validation/coprime_factors.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// x_{t+1} = A x_t + B u_t, y_t = C x_t + D u_t.
struct DiscreteStateSpace {
  Eigen::MatrixXd a;  ///< (n, n)
  Eigen::MatrixXd b;  ///< (n, m)
  Eigen::MatrixXd c;  ///< (p, n)
  Eigen::MatrixXd d;  ///< (p, m)

  Eigen::Index states() const { return a.rows(); }
  Eigen::Index inputs() const { return d.cols(); }
  Eigen::Index outputs() const { return d.rows(); }
};

/// Throws Error, with `name` in front, unless the sizes agree, all is finite and there is an input and an output.
void check(const DiscreteStateSpace& system, const char* name = "system");

/// y = D u.
DiscreteStateSpace static_gain(const Eigen::MatrixXd& d);

/// G with as many states as the longer of its polynomials has delays.
DiscreteStateSpace state_space(const DiscreteTransferFunction& g);

/// The matrix of transfer functions g[i][j] from input j to output i, without the states that it does not need.
/// Throws Error unless every row is as long as the first and none is empty.
DiscreteStateSpace transfer_matrix(const std::vector<std::vector<DiscreteTransferFunction>>& g);

/// The part of the system that its inputs reach and its outputs show: the same response from rest. What is smaller
/// than `tolerance`, in units of the largest singular value of [B, A] or [C; A], is taken as zero.
DiscreteStateSpace minimal(const DiscreteStateSpace& system, double tolerance = 1e-9);

/// (p, N) the response to u (m, N) from rest. Throws Error as check() does, and unless u has m rows.
Eigen::MatrixXd filter(const DiscreteStateSpace& system, const Eigen::MatrixXd& u);

/// Largest modulus of an eigenvalue; 0 for no states.
double spectral_radius(const DiscreteStateSpace& system);

/// F (m, n) such that A + B F has the eigenvalues of A inside the unit circle, and `pole` for each of the others; zero
/// for a stable A. With one input it is the only one; with several, each pole or pair is moved by the direction of the
/// input that reaches it best.
/// Throws Error unless |pole| < 1, and when no input reaches one of the modes to be moved.
Eigen::MatrixXd stabilising_feedback(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double pole);

}  // namespace blockid
