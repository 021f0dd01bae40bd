// Two well-known ways to rational models of a frequency response, as rivals in tests and benchmarks.
#pragma once

#include <blockid/data/frequency_response.hpp>

#include <Eigen/Core>

namespace blockid::testing {

/// G(s) = sum_k residue_k / (s - pole_k); conjugates side by side.
struct PoleResidueModel {
  Eigen::VectorXcd poles;
  Eigen::VectorXcd residues;
};

Eigen::VectorXcd response_at(const PoleResidueModel& model, const Eigen::VectorXd& omega_rad_s);

struct VectorFitting {
  PoleResidueModel model;
  int iterations = 0;
};

/// Relaxed vector fitting with `order` (even) poles, strictly proper: poles move to the zeros of
/// sigma(s) = d + sum c_k / (s - pole_k), where sigma G = sum r_k / (s - pole_k) by least squares with the weights
/// (F,), and the mean of Re sigma over the tones is one. Unstable ones are reflected. Pairs of damping 0.01, evenly
/// spaced logarithmically over the band, are the start; the residues of the last poles end it.
/// Ends early when no pole moves by more than 1e-10 of itself.
/// Source: Gustavsen and Semlyen 1999; Gustavsen 2006 (relaxation).
VectorFitting vector_fitting(const FrequencyResponse& data, const Eigen::VectorXd& weights, Eigen::Index order,
                             int iterations);

/// r(s) = sum_j w_j f_j / (s - z_j) over sum_j w_j / (s - z_j).
struct BarycentricModel {
  Eigen::VectorXcd support;
  Eigen::VectorXcd values;
  Eigen::VectorXcd weights;
};

Eigen::VectorXcd response_at(const BarycentricModel& model, const Eigen::VectorXd& omega_rad_s);
/// One less than there are support points.
Eigen::VectorXcd poles(const BarycentricModel& model);

/// AAA on the tones and their conjugates: support points are added in pairs where the error relative to |G| is largest,
/// until it is below the tolerance or the degree would exceed `max_degree`; weights from the smallest singular vector
/// of the Loewner matrix, rows divided by |G|. Source: Nakatsukasa, Sete and Trefethen 2018.
BarycentricModel aaa(const FrequencyResponse& data, double tolerance, Eigen::Index max_degree);

}  // namespace blockid::testing
