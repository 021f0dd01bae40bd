#include <blockid/estimators/continuous_chain.hpp>

#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <complex>
#include <limits>
#include <utility>
#include <vector>

namespace blockid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

Model model_of(ContinuousRational block, VectorXd theta) {
  const double sample_time_s = block.sampling().sample_time_s;
  Model model{.chain = Series({{"G", AnyBlock(std::move(block))}}), .parameters = std::move(theta)};
  model.sample_time_s = sample_time_s;
  return model;
}

/// theta of the block from [a; b], linear: for m = n the block counts its direct term first and the basis s / (s + p_n)
/// last.
MatrixXd parameter_map(const RationalBasis& basis) {
  const Index n = basis.order;
  const Index m = basis.numerator_degree;
  MatrixXd map = MatrixXd::Zero(n + m + 1, n + m + 1);
  map.bottomLeftCorner(n, n).setIdentity();
  if (m < n) {
    map.topRightCorner(m + 1, m + 1).setIdentity();
    return map;
  }
  const MatrixXd numerator = numerator_map(basis);
  map.block(0, n, 1, n + 1) = numerator.row(n);
  map.block(1, n, n, n + 1) = numerator.topRows(n);
  return map;
}

Model from_localising(const ContinuousTransferFunction& g, const Sampling& sampling, const MatrixXd& covariance) {
  const VectorXd& p = g.basis.points;
  ContinuousRational block(g.basis.numerator_degree, g.basis.order, sampling, {p.begin(), p.end()});
  const MatrixXd map = parameter_map(g.basis);
  VectorXd ab(map.cols());
  ab << g.denominator, g.numerator;
  Model model = model_of(std::move(block), map * ab);
  if (covariance.size() > 0) {
    model.standard_deviations = (map * covariance * map.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  }
  return model;
}

/// Moduli of the poles; the smallest positive one for a pole at zero.
std::vector<double> break_points_at(const VectorXcd& poles) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::complex<double>& pole : poles) {
    if (pole != 0.0) least = std::min(least, std::abs(pole));
  }
  if (!std::isfinite(least)) least = 1.0;
  std::vector<double> points;
  for (const std::complex<double>& pole : poles) points.push_back(std::max(std::abs(pole), least));
  return points;
}

Model from_roots(const ContinuousTransferFunction& g, const Sampling& sampling) {
  const ZeroPoleGain roots = zero_pole_gain(g);
  ContinuousRational block(g.basis.numerator_degree, g.basis.order, sampling, break_points_at(roots.poles));
  VectorXd theta =
      block.from_roots(roots.gain, {roots.zeros.begin(), roots.zeros.end()}, {roots.poles.begin(), roots.poles.end()});
  return model_of(std::move(block), std::move(theta));
}

}  // namespace

Model as_model(const ContinuousTransferFunction& g, const Sampling& sampling, const MatrixXd& covariance) {
  check(g);
  const Index parameters = g.denominator.size() + g.numerator.size();
  if (covariance.size() > 0 && (covariance.rows() != parameters || covariance.cols() != parameters)) {
    fail("continuous model as a chain: expected a covariance of ", parameters, " x ", parameters, ", got ",
         covariance.rows(), " x ", covariance.cols());
  }
  return g.basis.kind == BasisKind::localising ? from_localising(g, sampling, covariance) : from_roots(g, sampling);
}

}  // namespace blockid
