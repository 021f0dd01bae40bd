#include <blockid/estimators/recursive_trends.hpp>

#include <blockid/blocks/detail/view.hpp>
#include <blockid/data/error.hpp>

#include <limits>

namespace blockid {
namespace {

bool close_to_last(const Eigen::MatrixXd& history, Index k, double fraction) {
  const Index last = history.rows() - 1;
  return ((history.row(k) - history.row(last)).array().abs() <= fraction * history.row(last).array().abs()).all();
}

}  // namespace

RecursiveTrends::RecursiveTrends(const TrendStructure& structure, double sample_time_s, double forgetting)
    : rows_(structure, sample_time_s), least_squares_(rows_.columns(), forgetting) {}

bool RecursiveTrends::update(double u, double y) {
  if (!rows_.push(u, y)) return false;
  const Eigen::VectorXd& row = rows_.regressors();
  least_squares_.update(detail::view(row), rows_.regressand());
  return least_squares_.is_determined();
}

Eigen::MatrixXd trend_history(const Eigen::VectorXd& u, const Eigen::VectorXd& y, const TrendStructure& structure,
                              double sample_time_s, double forgetting) {
  if (u.size() != y.size()) fail("trends: expected inputs and outputs alike, got ", u.size(), " and ", y.size());
  RecursiveTrends recursion(structure, sample_time_s, forgetting);
  const Index columns = recursion.least_squares().parameter_count();
  Eigen::MatrixXd history = Eigen::MatrixXd::Constant(u.size(), columns, std::numeric_limits<double>::quiet_NaN());
  for (Index k = 0; k < u.size(); ++k) {
    recursion.update(u[k], y[k]);
    if (recursion.is_determined()) history.row(k) = recursion.estimate().transpose();
  }
  return history;
}

double convergence(const Eigen::MatrixXd& history, Index first, Index last) {
  if (first < 1 || first >= last || last > history.rows()) {
    fail("convergence: expected 1 <= first < last <= ", history.rows(), ", got ", first, " and ", last);
  }
  const Index count = last - first;
  const auto now = history.middleRows(first, count).array();
  const auto before = history.middleRows(first - 1, count).array();
  const double mean = ((now - before) / now).abs().rowwise().maxCoeff().mean();
  if (!history.middleRows(first - 1, count + 1).allFinite()) {
    fail("convergence: samples ", first - 1, "..", last - 1, " hold estimates that are not finite");
  }
  return mean;
}

Index settling_sample(const Eigen::MatrixXd& history, double fraction) {
  Index k = history.rows();
  while (k > 0 && close_to_last(history, k - 1, fraction)) --k;
  return k;
}

}  // namespace blockid
