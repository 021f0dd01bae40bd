#include <blockid/estimators/detail/state_damping.hpp>

#include <blockid/blocks/detail/view.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace blockid::detail {
namespace {

/// Times at which the states are looked at.
constexpr Index kLooks = 256;
/// Of the residual's size: a step may be so many times larger than the state is later.
constexpr double kShare = 0.1;
/// Decrease of the cost in a step below which all but the states has settled; they are let go step by step.
constexpr double kSettled = 1e-3;
constexpr double kRelease = 0.3;

}  // namespace

Eigen::VectorXd state_powers(const AnyBlock& chain, const Eigen::VectorXd& theta, const Eigen::VectorXd& u) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(chain.state_count());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(x.size());
  const Index step = std::clamp<Index>(u.size() / kLooks, 1, kMaxTileRows);
  std::vector<double> y(static_cast<std::size_t>(step));
  Index looks = 0;
  for (Index first = 0; first + step <= u.size(); first += step) {
    chain.apply(view(theta), view(x), {u.data() + first, static_cast<std::size_t>(step)}, y);
    sum += x.cwiseAbs2();
    ++looks;
  }
  return sum / static_cast<double>(std::max<Index>(looks, 1));
}

StateDamping::StateDamping(const Predictor& predictor, const Eigen::VectorXd& p, const std::vector<Index>& shown,
                           double rmse)
    : share_(kShare), weight_(kShare * rmse) {
  mutable_parameter_block_sizes()->push_back(static_cast<int>(shown.size()));
  const Index states = predictor.chain().state_count();
  const Index parameters = predictor.parameter_count();
  if (predictor.options().initial_state == InitialState::estimated && states > 0) {
    for (std::size_t i = 0; i < predictor.data().records.size(); ++i) {
      const Eigen::VectorXd power = state_powers(predictor.chain(), p.head(parameters), predictor.data().records[i].u);
      for (Index k = 0; k < states; ++k) {
        const Index unknown = parameters + static_cast<Index>(i) * states + k;
        const auto place = std::lower_bound(shown.begin(), shown.end(), unknown);
        if (!(power[k] > 0.0) || !std::isfinite(power[k]) || place == shown.end() || *place != unknown) continue;
        rows_.push_back({std::distance(shown.begin(), place), 1.0 / std::sqrt(power[k])});
      }
    }
  }
  set_num_residuals(static_cast<int>(rows_.size()));
}

void StateDamping::follow(double rmse, double decrease) {
  share_ = decrease < kSettled ? kRelease * share_ : kShare;
  weight_ = share_ * rmse;
}

bool StateDamping::Evaluate(const double* const*, double* residuals, double** jacobians) const {
  std::fill_n(residuals, rows_.size(), 0.0);
  if (jacobians == nullptr || jacobians[0] == nullptr) return true;
  const Index unknowns = parameter_block_sizes().front();
  std::fill_n(jacobians[0], std::ssize(rows_) * unknowns, 0.0);
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    jacobians[0][static_cast<Index>(k) * unknowns + rows_[k].position] = weight_ * rows_[k].inverse_size;
  }
  return true;
}

}  // namespace blockid::detail
