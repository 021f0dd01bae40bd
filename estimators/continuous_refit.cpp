#include <blockid/estimators/continuous_refit.hpp>

#include <blockid/blocks/detail/hold.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/continuous_chain.hpp>
#include <blockid/estimators/detail/mirrored_denominator.hpp>

#include <cmath>
#include <vector>

namespace blockid {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// (P, P) [a; b] from theta of the block, linear: for m = n the block counts its direct term b_0 first, which is the
/// coefficient of s / (s + p_n), and its other b have what that function brings.
MatrixXd coordinate_map(const RationalBasis& basis) {
  const Index n = basis.order;
  const Index m = basis.numerator_degree;
  MatrixXd map = MatrixXd::Zero(n + m + 1, n + m + 1);
  map.topRightCorner(n, n).setIdentity();
  if (m < n) {
    map.bottomLeftCorner(m + 1, m + 1).setIdentity();
    return map;
  }
  map.block(n, 1, n, n).setIdentity();
  map.block(n, 0, n, 1) = -numerator_map(basis).col(n).head(n);
  map(2 * n, 0) = 1.0;
  return map;
}

RationalBasis basis_of(const ContinuousRational& block) {
  const std::vector<double>& p = block.basis().break_points();
  return localising_basis(Eigen::Map<const VectorXd>(p.data(), std::ssize(p)), block.nb());
}

/// The records with weight zero where the hold would see beyond their ends.
DataSet with_ends_left_out(DataSet data, Hold hold) {
  const Index after = hold_latency(hold);
  const Index before = detail::held_taps(hold);
  for (Record& record : data.records) {
    const Index count = record.u.size();
    if (count <= before + after) {
      fail("continuous refit: hold ", to_text(hold), " leaves out ", before + after, " samples at the ends of ",
           describe(record), ", got ", count);
    }
    if (record.weights.size() == 0) record.weights = VectorXd::Ones(count);
    record.weights.head(before).setZero();
    record.weights.tail(after).setZero();
  }
  return data;
}

}  // namespace

ContinuousTransferFunction transfer_function_of(const ContinuousRational& block, const VectorXd& theta) {
  if (theta.size() != block.parameter_count()) {
    fail("continuous block: expected ", block.parameter_count(), " parameters, got ", theta.size());
  }
  const RationalBasis basis = basis_of(block);
  const VectorXd coordinates = coordinate_map(basis) * theta;
  return {basis, coordinates.head(basis.order), coordinates.tail(basis.numerator_degree + 1)};
}

namespace {

ContinuousRefit refit_from(const ContinuousTransferFunction& start, const DataSet& data, Hold hold,
                           const RefitOptions& options) {
  const Model model = as_model(start, {data.records.front().sample_time_s, hold});
  // A periodic record is run in by whole periods, and begins anew behind its end.
  const bool sees_ends = hold_latency(hold) > 0 && options.prediction.initial_state != InitialState::periodic;
  ContinuousRefit result{refit(model, sees_ends ? with_ends_left_out(data, hold) : data, options), {}, {}, {}};
  const ChildParameters child = top_level_blocks(result.report.model).front();
  const auto& block = *child.block.target<ContinuousRational>();
  result.transfer_function = transfer_function_of(block, child.parameters);
  if (!result.report.covariance) return result;
  const MatrixXd map = coordinate_map(basis_of(block));
  result.covariance = map * result.report.covariance->parameters * map.transpose();
  result.pole_deviations = pole_deviations(result.transfer_function, result.covariance);
  return result;
}

/// A start whose error is larger than that of the other fit by this factor is not worth a search: its simulation
/// explodes.
constexpr double kHopeless = 1e3;

double rmse_of_start(const ContinuousTransferFunction& start, const DataSet& data, Hold hold, RefitOptions options) {
  options.max_iterations = 0;
  options.covariance = false;
  return refit_from(start, data, hold, options).report.initial_rmse;
}

bool is_better(const RefitReport& report, const RefitReport& other) {
  if (!std::isfinite(other.rmse)) return std::isfinite(report.rmse);
  return report.rmse < other.rmse;
}

}  // namespace

ContinuousRefit refit(const ContinuousTransferFunction& start, const DataSet& data, Hold hold,
                      const RefitOptions& options) {
  check(data);
  if (is_stable(start)) return refit_from(start, data, hold, options);
  ContinuousTransferFunction mirrored = start;
  mirrored.denominator = detail::mirrored_denominator(start.basis, start.denominator);
  ContinuousRefit stable = refit_from(mirrored, data, hold, options);
  if (stable.report.status == FitStatus::cancelled) return stable;
  if (!(rmse_of_start(start, data, hold, options) <= kHopeless * stable.report.rmse)) return stable;
  ContinuousRefit as_given = refit_from(start, data, hold, options);
  return is_better(as_given.report, stable.report) ? as_given : stable;
}

}  // namespace blockid
