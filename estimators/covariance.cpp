#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/free_unknowns.hpp>
#include <blockid/estimators/detail/gram_parts.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/refit.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

/// Weight in an undetermined direction from which a parameter is named, relative to the largest.
constexpr double kNamedShare = 0.1;

std::vector<std::string> undetermined_names(const Model& model, const PseudoInverse& inverse,
                                            const Eigen::VectorXd& scale, const std::vector<Index>& free) {
  std::vector<Index> named;
  for (Index direction = 0; direction < inverse.null_space.cols(); ++direction) {
    const Eigen::VectorXd weight = inverse.null_space.col(direction).cwiseProduct(scale).cwiseAbs();
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (free[k] < model.parameters.size() && weight[static_cast<Index>(k)] > kNamedShare * weight.maxCoeff()) {
        named.push_back(free[k]);
      }
    }
  }
  std::sort(named.begin(), named.end());
  named.erase(std::unique(named.begin(), named.end()), named.end());
  return detail::names_of(model, named);
}

}  // namespace

Covariance covariance(const Model& model, const DataSet& data, const CovarianceOptions& options) {
  check(model);
  if (options.batch < 1) fail("covariance: a batch holds at least one sample, got ", options.batch);
  const Predictor predictor(model.chain, data, options.prediction);
  const Eigen::VectorXd p = detail::unknowns_of(model, predictor, options.initial_states);
  const std::vector<Index> fixed = detail::fixed_parameters(model, options.frozen, options.hold_gauges).all;
  const std::vector<Index> free = detail::complement(fixed, predictor.unknown_count());
  const Index parameters = model.parameters.size();

  Covariance result;
  result.free_count = static_cast<Index>(free.size());
  NormalEquations sums(predictor.unknown_count() + 1);
  if (!predictor.accumulate(p, sums)) {
    result.parameters = Eigen::MatrixXd::Constant(parameters, parameters, std::numeric_limits<double>::quiet_NaN());
    result.standard_deviations = result.parameters.diagonal();
    return result;
  }
  const Eigen::MatrixXd gram = sums.gram();
  const Eigen::MatrixXd normal = gram(free, free);
  const PseudoInverse inverse = scaled_pseudo_inverse(normal);
  result.rank = inverse.rank;
  result.condition = inverse.condition;
  const Index degrees_of_freedom = std::max<Index>(predictor.counted_samples() - inverse.rank, 1);
  result.noise_variance = gram(gram.rows() - 1, gram.cols() - 1) / static_cast<double>(degrees_of_freedom);

  Eigen::MatrixXd of_free = result.noise_variance * inverse.matrix;
  if (options.robust) {
    const Eigen::MatrixXd scores = predictor.score_batches(p, options.batch)(Eigen::all, free);
    of_free = inverse.matrix * (scores.transpose() * scores) * inverse.matrix;
  }
  Eigen::MatrixXd of_all = Eigen::MatrixXd::Zero(predictor.unknown_count(), predictor.unknown_count());
  of_all(free, free) = of_free;
  result.parameters = of_all.topLeftCorner(parameters, parameters);
  result.standard_deviations = result.parameters.diagonal().cwiseMax(0.0).cwiseSqrt();
  result.undetermined = undetermined_names(model, inverse, normal.diagonal().cwiseSqrt(), free);
  return result;
}

}  // namespace blockid
