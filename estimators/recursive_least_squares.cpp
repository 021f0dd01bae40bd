#include <blockid/estimators/recursive_least_squares.hpp>

#include <blockid/data/error.hpp>

#include <cmath>

namespace blockid {
namespace {

/// A pivot this small beside its column means that the rows so far do not determine the parameter.
constexpr double kPivotTolerance = 1e-13;

}  // namespace

RecursiveLeastSquares::RecursiveLeastSquares(Eigen::Index parameters, double forgetting)
    : parameters_(parameters), forgetting_(forgetting) {
  if (parameters < 1) fail("recursive least squares: expected at least one parameter, got ", parameters);
  if (!(forgetting > 0.0 && forgetting <= 1.0)) {
    fail("recursive least squares: expected a forgetting factor in (0, 1], got ", forgetting);
  }
  triangle_ = detail::RowMajor::Zero(parameters, parameters + 1);
  row_ = Eigen::VectorXd::Zero(parameters + 1);
}

void RecursiveLeastSquares::add_prior(const Eigen::VectorXd& mean, const Eigen::VectorXd& standard_deviation) {
  if (mean.size() != parameters_ || standard_deviation.size() != parameters_) {
    fail("recursive least squares: expected ", parameters_, " means and standard deviations, got ", mean.size(),
         " and ", standard_deviation.size());
  }
  for (Eigen::Index i = 0; i < parameters_; ++i) {
    if (!(standard_deviation[i] > 0.0)) {
      fail("recursive least squares: expected a positive standard deviation of parameter ", i, ", got ",
           standard_deviation[i]);
    }
  }
  for (Eigen::Index i = 0; i < parameters_; ++i) {
    row_.setZero();
    row_[i] = 1.0 / standard_deviation[i];
    row_[parameters_] = mean[i] / standard_deviation[i];
    rotate_in();
  }
}

void RecursiveLeastSquares::update(std::span<const double> regressors, double regressand, double weight) {
  if (std::ssize(regressors) != parameters_) {
    fail("recursive least squares: expected ", parameters_, " regressors, got ", regressors.size());
  }
  if (!(weight >= 0.0)) fail("recursive least squares: expected a weight of at least 0, got ", weight);
  for (Eigen::Index i = 0; i < parameters_; ++i) row_[i] = weight * regressors[static_cast<std::size_t>(i)];
  row_[parameters_] = weight * regressand;
  if (!row_.allFinite()) fail("recursive least squares: row ", rows_, " is not finite");
  if (forgetting_ < 1.0) {
    triangle_ *= std::sqrt(forgetting_);
    residual_ *= forgetting_;
  }
  effective_rows_ = forgetting_ * effective_rows_ + 1.0;
  ++rows_;
  rotate_in();
}

void RecursiveLeastSquares::rotate_in() {
  for (Eigen::Index i = 0; i < parameters_; ++i) {
    if (row_[i] == 0.0) continue;
    const double pivot = std::hypot(triangle_(i, i), row_[i]);
    const double c = triangle_(i, i) / pivot;
    const double s = row_[i] / pivot;
    triangle_(i, i) = pivot;
    for (Eigen::Index j = i + 1; j <= parameters_; ++j) {
      const double above = triangle_(i, j);
      triangle_(i, j) = c * above + s * row_[j];
      row_[j] = c * row_[j] - s * above;
    }
  }
  residual_ += row_[parameters_] * row_[parameters_];
}

bool RecursiveLeastSquares::is_determined() const {
  for (Eigen::Index i = 0; i < parameters_; ++i) {
    if (!(std::abs(triangle_(i, i)) > kPivotTolerance * triangle_.col(i).head(i + 1).norm())) return false;
  }
  return true;
}

void RecursiveLeastSquares::estimate(std::span<double> theta) const {
  if (std::ssize(theta) != parameters_) {
    fail("recursive least squares: expected room for ", parameters_, " parameters, got ", theta.size());
  }
  if (!is_determined()) fail("recursive least squares: ", rows_, " rows do not determine ", parameters_, " parameters");
  for (Eigen::Index i = parameters_ - 1; i >= 0; --i) {
    double value = triangle_(i, parameters_);
    for (Eigen::Index j = i + 1; j < parameters_; ++j) value -= triangle_(i, j) * theta[static_cast<std::size_t>(j)];
    theta[static_cast<std::size_t>(i)] = value / triangle_(i, i);
  }
}

Eigen::VectorXd RecursiveLeastSquares::estimate() const {
  Eigen::VectorXd theta(parameters_);
  estimate(std::span<double>(theta.data(), static_cast<std::size_t>(parameters_)));
  return theta;
}

Eigen::MatrixXd RecursiveLeastSquares::covariance() const {
  if (!is_determined()) fail("recursive least squares: ", rows_, " rows do not determine ", parameters_, " parameters");
  const Eigen::MatrixXd R = triangle_.leftCols(parameters_);
  const Eigen::MatrixXd inverse =
      R.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(parameters_, parameters_));
  const double freedom = std::max(effective_rows_ - static_cast<double>(parameters_), 1.0);
  return residual_ / freedom * inverse * inverse.transpose();
}

}  // namespace blockid
