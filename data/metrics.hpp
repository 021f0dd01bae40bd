#pragma once

#include <Eigen/Core>

namespace blockid {

/// Figures of merit of a simulated output yhat against a measured output y.
///
/// All of them are taken over the n scored samples S = {t : t >= warmup, w_t > 0}, each counted
/// once whatever its weight, so that they compare with published figures. e_t = y_t - yhat_t; mean
/// and std are those over S with 1/n. Where y is constant over S, the figures that divide by its
/// spread are NaN.
struct Metrics {
  double rmse = 0.0;         ///< sqrt(sum e_t^2 / n), in the unit of y
  double nrmse = 0.0;        ///< rmse / std(y)
  double fit_percent = 0.0;  ///< 100 (1 - nrmse); negative when worse than the mean of y
  double r2 = 0.0;           ///< 1 - sum e_t^2 / sum (y_t - mean y)^2 = 1 - nrmse^2
  double vaf = 0.0;          ///< 100 (1 - var(e) / var(y)), in percent; blind to a constant error
  double mae = 0.0;          ///< sum |e_t| / n, in the unit of y
  Eigen::Index samples = 0;  ///< n
  Eigen::Index warmup = 0;   ///< leading samples left out
};

/// All figures at once.
/// @param y (N,) measured; may be NaN where its weight is 0
/// @param yhat (N,) simulated; a non-finite value gives non-finite figures
/// @param warmup leading samples that are not scored, 0 <= warmup < N
/// @param weights (N,) each >= 0, 0 = missing; empty: none missing
/// @throws Error for unequal lengths, a warm-up or weight outside its limits, a non-finite scored
/// y_t (with its index) and
///   when no sample is left to score.
[[nodiscard]] Metrics evaluate_metrics(const Eigen::Ref<const Eigen::VectorXd>& y,
                                       const Eigen::Ref<const Eigen::VectorXd>& yhat, Eigen::Index warmup = 0,
                                       const Eigen::VectorXd& weights = {});

/// sqrt(sum e_t^2 / n). Parameters, limits and errors of this and the functions below:
/// evaluate_metrics.
[[nodiscard]] double rmse(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::Ref<const Eigen::VectorXd>& yhat,
                          Eigen::Index warmup = 0, const Eigen::VectorXd& weights = {});

/// rmse / std(y)
[[nodiscard]] double nrmse(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::Ref<const Eigen::VectorXd>& yhat,
                           Eigen::Index warmup = 0, const Eigen::VectorXd& weights = {});

/// 100 (1 - nrmse)
[[nodiscard]] double fit_percent(const Eigen::Ref<const Eigen::VectorXd>& y,
                                 const Eigen::Ref<const Eigen::VectorXd>& yhat, Eigen::Index warmup = 0,
                                 const Eigen::VectorXd& weights = {});

/// 1 - sum e_t^2 / sum (y_t - mean y)^2
[[nodiscard]] double r2(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::Ref<const Eigen::VectorXd>& yhat,
                        Eigen::Index warmup = 0, const Eigen::VectorXd& weights = {});

/// 100 (1 - var(e) / var(y)), in percent
[[nodiscard]] double vaf(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::Ref<const Eigen::VectorXd>& yhat,
                         Eigen::Index warmup = 0, const Eigen::VectorXd& weights = {});

/// sum |e_t| / n
[[nodiscard]] double mae(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::Ref<const Eigen::VectorXd>& yhat,
                         Eigen::Index warmup = 0, const Eigen::VectorXd& weights = {});

}  // namespace blockid
