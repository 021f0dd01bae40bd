// Parameters in which the whole chain is affine: those of static blocks with nothing but linear blocks behind them.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/estimators/predictor.hpp>

#include <vector>

namespace blockid {

/// Indices into theta, ascending, in which yhat is jointly affine for fixed other parameters; empty when there are
/// none.
///
/// In a row: the parameters of the last block that is not linear, if it is affine in them. In a sum: those of each
/// branch.
std::vector<Index> affine_parameters(const AnyBlock& chain);

/// Affine parameters of one block whose basis functions differ from zero on a piece of the input's range only:
/// ascending indices into theta.
using LocalBasis = std::vector<Index>;

/// Of the splines and polylines among the blocks of affine_parameters().
std::vector<LocalBasis> local_bases(const AnyBlock& chain);

/// A model after least squares over its affine parameters.
struct StaticFit {
  Model model;
  /// sqrt(sum r^2 / counted samples).
  double rmse = 0.0;
  Index rank = 0;
  double condition = 1.0;
  /// False when the chain's prediction was not finite; the model is then the start.
  bool finite = false;
};

/// argmin over the affine parameters of sum_t r_t^2, all other parameters as in `model`: one pass over the data.
/// Throws Error when the chain has no affine parameters. Directions without data keep the values of `model`, and
/// so do parameters of a local basis that the data hardly touch.
StaticFit fit_static(const Model& model, const DataSet& data, const PredictionOptions& options = {});

/// The model with those parameters of local bases that the data do not or hardly touch on the straight line through
/// their two nearest touched neighbours: a spline goes on beyond the data as it left them.
Model with_untouched_straightened(const Model& model, const DataSet& data, const PredictionOptions& options = {});

}  // namespace blockid
