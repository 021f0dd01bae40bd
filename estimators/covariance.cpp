#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/free_unknowns.hpp>
#include <blockid/estimators/detail/gram_parts.hpp>
#include <blockid/estimators/detail/local_covariance.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/refit.hpp>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

/// Weight in an undetermined direction from which a parameter is named, relative to the largest.
constexpr double kNamedShare = 0.1;

/// Singular value of the scaled J below which its direction counts as undetermined, relative to the largest.
constexpr double kRankTolerance = 1e-10;

/// Pseudo-inverse of J'J from R with R'R = J'J, by singular values of R after scaling its columns: the condition number
/// is not squared, as it would be by J'J.
struct TriangleInverse {
  PseudoInverse inverse;
  /// L with L L' = inverse.matrix.
  Eigen::MatrixXd root;
  /// Norms of the columns.
  Eigen::VectorXd scale;
};

TriangleInverse inverse_of(const Eigen::MatrixXd& triangle) {
  TriangleInverse result;
  const Index n = triangle.cols();
  result.scale = triangle.colwise().norm();
  result.root = Eigen::MatrixXd::Zero(n, n);
  result.inverse.matrix = Eigen::MatrixXd::Zero(n, n);
  if (n == 0) return result;
  const Eigen::VectorXd unscale = result.scale.unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  const Eigen::MatrixXd scaled = triangle * unscale.asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& values = svd.singularValues();
  result.inverse.rank = (values.array() > kRankTolerance * values[0]).count();
  const Index rank = result.inverse.rank;
  result.inverse.condition = rank == n ? values[0] / values[n - 1] : std::numeric_limits<double>::infinity();
  result.root.leftCols(rank) =
      unscale.asDiagonal() * svd.matrixV().leftCols(rank) * values.head(rank).cwiseInverse().asDiagonal();
  result.inverse.matrix = result.root * result.root.transpose();
  result.inverse.null_space = unscale.asDiagonal() * svd.matrixV().rightCols(n - rank);
  return result;
}

std::vector<std::string> undetermined_names(const std::vector<std::string>& names, const PseudoInverse& inverse,
                                            const Eigen::VectorXd& scale, const std::vector<Index>& free) {
  std::vector<Index> named;
  for (Index direction = 0; direction < inverse.null_space.cols(); ++direction) {
    const Eigen::VectorXd weight = inverse.null_space.col(direction).cwiseProduct(scale).cwiseAbs();
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (free[k] < std::ssize(names) && weight[static_cast<Index>(k)] > kNamedShare * weight.maxCoeff()) {
        named.push_back(free[k]);
      }
    }
  }
  std::sort(named.begin(), named.end());
  named.erase(std::unique(named.begin(), named.end()), named.end());
  std::vector<std::string> result;
  for (const Index k : named) result.push_back(names[static_cast<std::size_t>(k)]);
  return result;
}

}  // namespace

Covariance detail::local_covariance(const ResidualFunction& residuals, const Eigen::VectorXd& p,
                                    const std::vector<Index>& fixed, const std::vector<std::string>& names,
                                    const ScoreBatches& scores) {
  const Index unknowns = residuals.unknown_count();
  const Index parameters = std::ssize(names);
  const std::vector<Index> free = complement(fixed, unknowns);
  Covariance result;
  result.free_count = std::ssize(free);
  QrTriangle sums(unknowns + 1);
  if (!residuals.accumulate(p, sums)) {
    result.parameters = Eigen::MatrixXd::Constant(parameters, parameters, std::numeric_limits<double>::quiet_NaN());
    result.standard_deviations = result.parameters.diagonal();
    return result;
  }
  const Eigen::MatrixXd& triangle = sums.triangle();
  const TriangleInverse solved = inverse_of(triangle(Eigen::all, free));
  result.rank = solved.inverse.rank;
  result.condition = solved.inverse.condition;
  const Index degrees_of_freedom = std::max<Index>(residuals.counted_samples() - result.rank, 1);
  result.noise_variance = triangle.rightCols(1).squaredNorm() / static_cast<double>(degrees_of_freedom);

  Eigen::MatrixXd of_free = result.noise_variance * solved.inverse.matrix;
  if (scores) {
    const Eigen::MatrixXd root = solved.root * (scores()(Eigen::all, free) * solved.root).transpose();
    of_free = root * root.transpose();
  }
  Eigen::MatrixXd of_all = Eigen::MatrixXd::Zero(unknowns, unknowns);
  of_all(free, free) = of_free;
  result.parameters = of_all.topLeftCorner(parameters, parameters);
  result.standard_deviations = result.parameters.diagonal().cwiseMax(0.0).cwiseSqrt();
  result.undetermined = undetermined_names(names, solved.inverse, solved.scale, free);
  return result;
}

Covariance covariance(const Model& model, const DataSet& data, const CovarianceOptions& options) {
  check(model);
  if (options.batch < 1) fail("covariance: a batch holds at least one sample, got ", options.batch);
  const Predictor predictor(model.chain, data, options.prediction);
  const Eigen::VectorXd p = detail::unknowns_of(model, predictor, options.initial_states);
  const std::vector<Index> fixed = detail::fixed_parameters(model, options.frozen, options.hold_gauges).all;
  detail::ScoreBatches scores;
  if (options.robust) scores = [&] { return predictor.score_batches(p, options.batch); };
  return detail::local_covariance(predictor, p, fixed, model.chain.parameter_names(), scores);
}

}  // namespace blockid
