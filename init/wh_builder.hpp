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

/// Builds starting models of one chain `rational | static block | rational` (either filter may be missing): G_W scaled
/// to unit output deviation, the static block placed for the signal that reaches it and fitted by least squares.
///
/// Candidates are ranked with cheaper twins: an oversampled static block without oversampling, and a spline in place of
/// one that is not linear in its parameters. finished() puts the chain's own in their place. Keeps a reference to the
/// data.
class WienerHammersteinBuilder {
 public:
  /// Throws Error for any other chain; `who` asks, for the message.
  WienerHammersteinBuilder(const AnyBlock& chain, const std::string& who, const DataSet& data,
                           const PredictionOptions& prediction);

  /// The chain without oversampling.
  const WienerHammersteinStructure& structure() const { return structure_; }
  /// Whether the chain is its own twin: static block linear in its parameters and not oversampled.
  bool plain() const { return affine_ && !oversampled_; }
  /// The twin.
  AnyBlock plain_chain() const;
  /// The static block, or the spline that stands for it.
  AnyBlock affine_static_block() const;

  /// first, second: theta of G_W and G_H, empty for a filter that the chain lacks. The error is infinite when the
  /// filters' signals are not finite or vanish.
  Candidate build(const Eigen::VectorXd& first, const Eigen::VectorXd& second, std::string how) const;

  /// Candidates with finite errors, best first, `keep` at most, with the chain's own static block.
  std::vector<Candidate> finished(std::vector<Candidate> candidates, Index keep) const;

 private:
  StaticFit fitted(const Eigen::VectorXd& first, const Eigen::VectorXd& second) const;
  Model with_own_static_block(const Model& surrogate) const;
  Model with_own_oversampling(const Model& plain) const;

  AnyBlock chain_;
  WienerHammersteinStructure structure_;
  const DataSet& data_;
  PredictionOptions prediction_;
  bool affine_;
  bool oversampled_;
};

}  // namespace blockid
