#include <blockid/blocks/taylor_expansion.hpp>
#include <blockid/data/error.hpp>
#include <blockid/init/fractional_exponents.hpp>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace blockid {
namespace {

/// Roots at the same place and the exponent d = sum alpha - sum beta that they have together.
struct DistinctRoot {
  std::complex<double> value;
  std::vector<Index> poles;
  std::vector<Index> zeros;

  Index members() const { return std::ssize(poles) + std::ssize(zeros); }
  /// d when all exponents are 1/2.
  double middle() const { return 0.5 * static_cast<double>(std::ssize(poles) - std::ssize(zeros)); }
};

double largest_radius(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros) {
  double radius = 0.0;
  for (const auto* groups : {&poles, &zeros}) {
    for (const RootGroup& group : *groups) {
      if (group.kind == RootGroup::Kind::infinite)
        fail("fractional exponents: an infinite root is a delay, take it out");
      radius = std::max(radius, std::abs(group.value));
    }
  }
  return radius;
}

std::vector<DistinctRoot> distinct_roots(const std::vector<RootGroup>& poles, const std::vector<RootGroup>& zeros,
                                         double distance) {
  std::vector<DistinctRoot> distinct;
  const auto place = [&](std::complex<double> value) -> DistinctRoot& {
    for (DistinctRoot& root : distinct) {
      if (std::abs(root.value - value) <= distance) return root;
    }
    return distinct.emplace_back(DistinctRoot{value, {}, {}});
  };
  for (Index i = 0; i < std::ssize(poles); ++i) place(poles[static_cast<std::size_t>(i)].value).poles.push_back(i);
  for (Index j = 0; j < std::ssize(zeros); ++j) place(zeros[static_cast<std::size_t>(j)].value).zeros.push_back(j);
  return distinct;
}

/// c_k / radius^k.
Eigen::VectorXd scaled(const Eigen::VectorXd& coefficients, double radius) {
  Eigen::VectorXd result = coefficients / coefficients[0];
  double factor = 1.0;
  for (Index k = 0; k < result.size(); ++k, factor /= radius) result[k] *= factor;
  return result;
}

/// The members' exponents for d = sum alpha - sum beta, as near to 1/2 as they can be.
void share_out(const DistinctRoot& root, double d, FractionalExponents& result) {
  const double deviation = (d - root.middle()) / static_cast<double>(root.members());
  for (const Index i : root.poles) result.alpha[i] = 0.5 + deviation;
  for (const Index j : root.zeros) result.beta[j] = 0.5 - deviation;
  if (root.members() > 1) result.shared.push_back({root.poles, root.zeros, d});
}

}  // namespace

FractionalExponents fractional_exponents(const Eigen::VectorXd& coefficients, const std::vector<RootGroup>& poles,
                                         const std::vector<RootGroup>& zeros, const ExponentOptions& options) {
  const double largest = largest_radius(poles, zeros);
  const Eigen::VectorXd sums = power_sums(coefficients);
  FractionalExponents result;
  result.alpha = Eigen::VectorXd::Constant(std::ssize(poles), 0.5);
  result.beta = Eigen::VectorXd::Constant(std::ssize(zeros), 0.5);
  std::vector<DistinctRoot> distinct = distinct_roots(poles, zeros, options.merge_distance * largest);
  const auto at_origin = std::find_if(distinct.begin(), distinct.end(), [&](const DistinctRoot& root) {
    return std::abs(root.value) <= options.merge_distance * largest;
  });
  if (at_origin != distinct.end()) {
    result.shared.push_back({at_origin->poles, at_origin->zeros, at_origin->middle()});
    distinct.erase(at_origin);
  }
  const Index m = sums.size();
  result.unknowns = std::ssize(distinct);
  if (m < result.unknowns) {
    fail("fractional exponents: expected at least ", result.unknowns, " coefficients beside A_0 for as many distinct ",
         "roots, got ", m);
  }
  if (result.unknowns == 0) return result;

  const double radius = options.error_decay > 0.0 ? options.error_decay : largest;
  const Eigen::VectorXd a = scaled(coefficients, radius);
  Eigen::MatrixXd columns(m, result.unknowns);
  Eigen::VectorXd rest = taylor_tangent(a, power_sums(a)).tail(m);
  for (Index c = 0; c < result.unknowns; ++c) {
    const DistinctRoot& root = distinct[static_cast<std::size_t>(c)];
    columns.col(c) = taylor_tangent(a, root_powers(root.value / radius, m)).tail(m);
    rest -= root.middle() * columns.col(c);
  }
  const Eigen::VectorXd norms = columns.colwise().norm();
  columns *= norms.cwiseInverse().asDiagonal();

  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr;
  qr.setThreshold(options.rank_tolerance);
  qr.compute(columns);
  const Eigen::VectorXd solution = qr.solve(rest);
  const Eigen::VectorXd singular = Eigen::JacobiSVD<Eigen::MatrixXd>(columns).singularValues();
  result.rank = qr.rank();
  result.condition = result.rank < result.unknowns ? std::numeric_limits<double>::infinity()
                                                   : singular[0] / singular[singular.size() - 1];
  const double size = a.tail(m).norm();
  result.residual = size > 0.0 ? (rest - columns * solution).norm() / size : 0.0;
  for (Index c = 0; c < result.unknowns; ++c) {
    const DistinctRoot& root = distinct[static_cast<std::size_t>(c)];
    share_out(root, root.middle() + solution[c] / norms[c], result);
  }
  return result;
}

std::string undetermined_text(const FractionalExponents& exponents, const std::vector<RootGroup>& poles,
                              const std::vector<RootGroup>& zeros) {
  std::string text;
  for (const SharedRoot& root : exponents.shared) {
    const RootGroup& group = root.poles.empty() ? zeros[static_cast<std::size_t>(root.zeros.front())]
                                                : poles[static_cast<std::size_t>(root.poles.front())];
    const std::string what = !root.zeros.empty() && !root.poles.empty() ? "pole and zero cancel at "
                             : root.poles.empty()                       ? "zero repeated at "
                                                                        : "pole repeated at ";
    const bool origin = std::ssize(root.poles) + std::ssize(root.zeros) == 1;
    text += (text.empty() ? "" : "; ") + (origin ? "root at the origin, " : what) + to_text(group) +
            (origin ? ": no exponent" : ": only the sum of exponents (zeros counted negative)");
  }
  if (exponents.rank < exponents.unknowns) {
    text += (text.empty() ? "" : "; ") + std::to_string(exponents.unknowns - exponents.rank) +
            " combinations of exponents of nearby roots";
  }
  return text;
}

}  // namespace blockid
