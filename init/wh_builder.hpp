// From the numbers of two filters to a starting model: the static block placed and fitted.
#pragma once

#include <blockid/estimators/candidate.hpp>
#include <blockid/estimators/static_parameters.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/root_groups.hpp>
#include <blockid/init/wh_structure.hpp>

#include <Eigen/Core>
#include <string>
#include <vector>

namespace blockid {

/// theta = [b, a] of a rational filter with the given zeros and poles; coefficients that they leave over are zero.
Eigen::VectorXd filter_parameters(const Rational& filter, const std::vector<RootGroup>& zeros,
                                  const std::vector<RootGroup>& poles);

/// Degrees and delays of both filters added up: the orders of the chain's best linear approximation.
BlaOrders joint_orders(const WienerHammersteinStructure& structure);

/// The first samples behind the warm-up of each record; the whole record where that would cut its period. 0: all.
DataSet first_samples(const DataSet& data, Index samples, Index warmup);

/// Builds starting models of one structure: G_W scaled to unit output deviation, the static block placed for the signal
/// that reaches it and fitted by least squares.
///
/// A static block that is not linear in its parameters is represented by a spline while candidates are ranked, and then
/// fitted to that spline's curve (finished()). Keeps references to the structure and the data.
class WienerHammersteinBuilder {
 public:
  WienerHammersteinBuilder(const WienerHammersteinStructure& structure, const DataSet& data,
                           const PredictionOptions& prediction);

  /// first, second: theta of G_W and G_H, empty for a filter that the chain lacks. The error is infinite when the
  /// filters' signals are not finite or vanish.
  Candidate build(const Eigen::VectorXd& first, const Eigen::VectorXd& second, std::string how) const;

  /// Candidates with finite errors, best first, `keep` at most, with the chain's own static block.
  std::vector<Candidate> finished(std::vector<Candidate> candidates, Index keep) const;

 private:
  StaticFit fitted(const Eigen::VectorXd& first, const Eigen::VectorXd& second) const;
  Model with_own_static_block(const Model& surrogate) const;

  const WienerHammersteinStructure& structure_;
  const DataSet& data_;
  PredictionOptions prediction_;
  bool affine_;
};

}  // namespace blockid
