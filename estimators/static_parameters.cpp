#include <blockid/estimators/static_parameters.hpp>

#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/piecewise_linear.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/tied.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/gram_parts.hpp>
#include <blockid/estimators/detail/unknowns.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numeric>

namespace blockid {
namespace {

/// Numbers that only affine inner parameters follow.
std::vector<Index> affine_numbers(const Tied& tied) {
  std::vector<Index> found;
  const std::vector<Index> inner = affine_parameters(tied.inner());
  for (Index j = 0; j < tied.parameter_count(); ++j) {
    bool affine = true;
    for (Index k = 0; k < std::ssize(tied.ties()); ++k) {
      if (tied.ties()[static_cast<std::size_t>(k)].index != j) continue;
      affine = affine && std::binary_search(inner.begin(), inner.end(), k);
    }
    if (affine) found.push_back(j);
  }
  return found;
}

/// visit(block, offset): every block with affine parameters that is neither a row nor a sum; offset of its theta.
template <class Visit>
void visit_affine(const AnyBlock& block, Index offset, const Visit& visit) {
  if (block.target<Tied>() != nullptr) return visit(block, offset);
  // Resampling is linear.
  if (const auto* oversampled = block.target<Oversampled>()) {
    visit_affine(oversampled->inner(), offset, visit);
    return;
  }
  const std::vector<LabelledBlock> children = block.children();
  if (children.empty()) {
    if (!block.is_linear() && block.is_linear_in_parameters()) visit(block, offset);
    return;
  }
  if (const auto* series = block.target<Series>()) {
    for (std::size_t k = children.size(); k-- > 0;) {
      if (children[k].block.is_linear()) continue;
      visit_affine(children[k].block, offset + series->parameter_offset(static_cast<Index>(k)), visit);
      return;
    }
    return;
  }
  for (const LabelledBlock& branch : children) {
    visit_affine(branch.block, offset, visit);
    offset += branch.block.parameter_count();
  }
}

}  // namespace

std::vector<Index> affine_parameters(const AnyBlock& chain) {
  std::vector<Index> found;
  visit_affine(chain, 0, [&found](const AnyBlock& block, Index offset) {
    if (const auto* tied = block.target<Tied>()) {
      for (const Index k : affine_numbers(*tied)) found.push_back(offset + k);
      return;
    }
    for (Index k = 0; k < block.parameter_count(); ++k) found.push_back(offset + k);
  });
  return found;
}

namespace {

bool is_local(const AnyBlock& block) {
  return block.target<Spline>() != nullptr || block.target<PiecewiseLinear>() != nullptr;
}

}  // namespace

std::vector<LocalBasis> local_bases(const AnyBlock& chain) {
  std::vector<LocalBasis> found;
  visit_affine(chain, 0, [&found](const AnyBlock& block, Index offset) {
    if (!is_local(block)) return;
    LocalBasis basis(static_cast<std::size_t>(block.parameter_count()));
    std::iota(basis.begin(), basis.end(), offset);
    found.push_back(std::move(basis));
  });
  return found;
}

namespace {

/// (n_theta,) where on the input's axis a parameter of a local basis acts: a spline's Greville abscissae, the knots of
/// a polyline. Zero for all others.
Eigen::VectorXd abscissae(const AnyBlock& chain) {
  Eigen::VectorXd all = Eigen::VectorXd::Zero(chain.parameter_count());
  visit_affine(chain, 0, [&all](const AnyBlock& block, Index offset) {
    // y = u: each parameter is its place on the axis.
    if (is_local(block)) all.segment(offset, block.parameter_count()) = block.initial_parameters();
  });
  return all;
}

/// Parameters of the basis that are listed, in a straight line with the nearest two that are not.
void straighten(const LocalBasis& basis, const std::vector<Index>& untouched, const Eigen::VectorXd& places,
                Eigen::VectorXd& theta) {
  std::vector<Index> touched;
  std::set_difference(basis.begin(), basis.end(), untouched.begin(), untouched.end(), std::back_inserter(touched));
  if (touched.size() < 2) return;
  for (const Index k : basis) {
    if (!std::binary_search(untouched.begin(), untouched.end(), k)) continue;
    const auto above = std::lower_bound(touched.begin() + 1, touched.end() - 1, k);
    const Index left = *(above - 1);
    const Index right = *above;
    const double slope = (theta[right] - theta[left]) / (places[right] - places[left]);
    theta[k] = theta[left] + slope * (places[k] - places[left]);
  }
}

}  // namespace

Model with_untouched_straightened(const Model& model, const DataSet& data, const PredictionOptions& options) {
  const std::vector<LocalBasis> bases = local_bases(model.chain);
  if (bases.empty()) return model;
  const Predictor predictor(model.chain, data, options);
  NormalEquations sums(predictor.unknown_count() + 1);
  if (!predictor.accumulate(detail::unknowns_of(model, predictor), sums)) return model;
  const std::vector<Index> untouched = detail::untouched_parameters(sums.gram(), bases);
  const Eigen::VectorXd places = abscissae(model.chain);
  Model result = model;
  for (const LocalBasis& basis : bases) straighten(basis, untouched, places, result.parameters);
  return result;
}

StaticFit fit_static(const Model& model, const DataSet& data, const PredictionOptions& options) {
  check(model);
  const std::vector<Index> affine = affine_parameters(model.chain);
  if (affine.empty()) {
    fail("fit_static: no static block of the chain is linear in its parameters with only linear blocks behind it");
  }
  const Predictor predictor(model.chain, data, options);
  const Eigen::VectorXd p = detail::unknowns_of(model, predictor);
  NormalEquations sums(predictor.unknown_count() + 1);
  StaticFit result{model, std::numeric_limits<double>::infinity(), 0, std::numeric_limits<double>::infinity(), false};
  if (!predictor.accumulate(p, sums)) return result;
  Eigen::MatrixXd gram = sums.gram();
  detail::leave_out(detail::untouched_parameters(gram, local_bases(model.chain)), gram);
  const LinearSolution solution = solve_least_squares(detail::gram_of(gram, affine));
  // J = dr/dc, so the minimiser of |r + J dc| is minus that of |r - J x|.
  result.model.parameters(affine) -= solution.x;
  result.rmse = std::sqrt(solution.residual_sum_of_squares / static_cast<double>(predictor.counted_samples()));
  result.rank = solution.rank;
  result.condition = solution.condition;
  result.finite = true;
  return result;
}

}  // namespace blockid
