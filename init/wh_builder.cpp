#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/init/wh_builder.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace blockid {
namespace {

/// Knots of the spline that stands in for a static block that is not linear in its parameters.
constexpr Index kSurrogateKnots = 12;
/// Points of its curve that such a block is then fitted to.
constexpr Index kCurvePoints = 100;
/// Starts of that fit, how far they lie from the first one, iterations of all, how many of them go on to how many.
constexpr int kCurveStarts = 96;
constexpr double kCurveSpread = 6.0;
constexpr int kCurveRace = 12;
constexpr int kCurveFinalists = 4;
constexpr int kCurveIterations = 100;
/// Share of the curve's deviation that ends the fit: what the spline itself may be off.
constexpr double kCurveTolerance = 0.002;
constexpr std::uint64_t kCurveSeed = 1;

double standard_deviation(const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

Eigen::VectorXd filtered(const Rational& filter, const Eigen::VectorXd& theta, const Eigen::VectorXd& u) {
  Model model = make_model(filter);
  model.parameters = theta;
  return simulate(model, u);
}

/// The curve (v, w) of a static block at the quantiles of v in equal steps.
Record curve_of(const Eigen::VectorXd& v, const Eigen::VectorXd& w) {
  std::vector<Index> order(static_cast<std::size_t>(v.size()));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return v[a] < v[b]; });
  const Index points = std::min(kCurvePoints, v.size());
  Record curve;
  curve.u = Eigen::VectorXd(points);
  curve.y = Eigen::VectorXd(points);
  for (Index k = 0; k < points; ++k) {
    const Index place = points > 1 ? k * (v.size() - 1) / (points - 1) : 0;
    const Index sample = order[static_cast<std::size_t>(place)];
    curve.u[k] = v[sample];
    curve.y[k] = w[sample];
  }
  return curve;
}

/// The best of several refits to a curve: the first from `start`, then the best of a race from draws around its first
/// `drawn` parameters, the gain behind them in either sign. Ends with the first that is near enough.
Model fitted_to_curve(const Model& start, Index drawn, const Record& curve) {
  RefitOptions settings;
  settings.max_iterations = kCurveIterations;
  settings.covariance = false;
  const double enough = kCurveTolerance * standard_deviation(curve.y);
  RefitReport best = refit(start, curve, settings);
  if (best.rmse <= enough) return best.model;
  std::mt19937_64 engine(kCurveSeed);
  std::vector<RefitReport> race;
  settings.max_iterations = kCurveRace;
  for (int draw = 1; draw < kCurveStarts; ++draw) {
    Model other = start;
    for (Index k = 0; k < drawn; ++k) {
      other.parameters[k] += kCurveSpread * (2.0 * 0x1.0p-64 * static_cast<double>(engine()) - 1.0);
    }
    if (draw % 2 == 0) other.parameters.tail(other.parameters.size() - drawn) *= -1.0;
    race.push_back(refit(other, curve, settings));
  }
  std::erase_if(race, [](const RefitReport& report) { return !std::isfinite(report.rmse); });
  std::stable_sort(race.begin(), race.end(), [](const auto& a, const auto& b) { return a.rmse < b.rmse; });
  settings.max_iterations = kCurveIterations;
  for (std::size_t k = 0; k < race.size() && k < kCurveFinalists && !(best.rmse <= enough); ++k) {
    RefitReport report = refit(race[k].model, curve, settings);
    if (report.rmse < best.rmse || !std::isfinite(best.rmse)) best = std::move(report);
  }
  return best.model;
}

StaticFit failed(const std::vector<LabelledBlock>& blocks) {
  return {make_model(Series(blocks)), std::numeric_limits<double>::infinity(), 0, 0.0, false};
}

Index nb_of(const Rational* filter) { return filter == nullptr ? 0 : filter->nb(); }
Index na_of(const Rational* filter) { return filter == nullptr ? 0 : filter->na(); }
Index nk_of(const Rational* filter) { return filter == nullptr ? 0 : filter->nk(); }

}  // namespace

Eigen::VectorXd filter_parameters(const Rational& filter, const std::vector<RootGroup>& zeros,
                                  const std::vector<RootGroup>& poles) {
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(filter.parameter_count());
  const Eigen::VectorXd b = product(zeros);
  Eigen::VectorXd a = product(poles);
  a /= a[0];
  theta.head(b.size()) = b;
  theta.segment(filter.nb() + 1, a.size() - 1) = a.tail(a.size() - 1);
  return theta;
}

BlaOrders joint_orders(const WienerHammersteinStructure& structure) {
  const Rational* g_w = structure.g_w();
  const Rational* g_h = structure.g_h();
  return {nb_of(g_w) + nb_of(g_h), na_of(g_w) + na_of(g_h), nk_of(g_w) + nk_of(g_h)};
}

DataSet first_samples(const DataSet& data, Index samples, Index warmup) {
  if (samples <= 0) return data;
  DataSet result;
  for (const Record& record : data.records) {
    const bool whole = samples + warmup >= record.u.size() || samples + warmup < record.period;
    result.records.push_back(whole ? record : slice(record, 0, samples + warmup));
  }
  return result;
}

WienerHammersteinBuilder::WienerHammersteinBuilder(const AnyBlock& chain, const std::string& who, const DataSet& data,
                                                   const PredictionOptions& prediction)
    : chain_(chain),
      structure_(wiener_hammerstein_structure(without_oversampling(chain), who)),
      data_(data),
      prediction_(prediction) {
  affine_ = structure_.blocks[structure_.static_block].block.is_linear_in_parameters();
  const WienerHammersteinStructure wanted = wiener_hammerstein_structure(chain, who);
  oversampled_ = !wanted.blocks[wanted.static_block].block.is_static();
}

AnyBlock WienerHammersteinBuilder::affine_static_block() const {
  return affine_ ? structure_.blocks[structure_.static_block].block : AnyBlock(Spline(kSurrogateKnots));
}

AnyBlock WienerHammersteinBuilder::plain_chain() const {
  std::vector<LabelledBlock> blocks = structure_.blocks;
  blocks[structure_.static_block].block = affine_static_block();
  return Series(std::move(blocks));
}

StaticFit WienerHammersteinBuilder::fitted(const Eigen::VectorXd& first, const Eigen::VectorXd& second) const {
  std::vector<LabelledBlock> blocks = structure_.blocks;
  blocks[structure_.static_block].block = affine_static_block();
  Eigen::VectorXd v = data_.records.front().u;
  Eigen::VectorXd scaled_first = first;
  if (const Rational* g_w = structure_.g_w()) {
    v = filtered(*g_w, first, v);
    const double deviation = standard_deviation(v);
    if (!std::isfinite(deviation) || !(deviation > 0.0)) return failed(blocks);
    scaled_first.head(g_w->nb() + 1) /= deviation;
    v /= deviation;
  }
  AnyBlock& f = blocks[structure_.static_block].block;
  f = f.adapted_to(detail::view(v));
  std::vector<double> theta;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Eigen::VectorXd part = blocks[k].block.initial_parameters();
    if (structure_.first_filter == k) part = scaled_first;
    if (structure_.second_filter == k) part = second;
    theta.insert(theta.end(), part.begin(), part.end());
  }
  Model model = make_model(Series(std::move(blocks)), data_.records.front().sample_time_s);
  model.parameters = Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()));
  return fit_static(model, data_, prediction_);
}

Candidate WienerHammersteinBuilder::build(const Eigen::VectorXd& first, const Eigen::VectorXd& second,
                                          std::string how) const {
  const StaticFit fit = fitted(first, second);
  return {fit.model, fit.finite ? fit.rmse : std::numeric_limits<double>::infinity(), std::move(how)};
}

/// The chain's own static block in place of the surrogate spline: fitted with a gain behind it to the spline's curve
/// over the signal that reaches it; the gain goes into the filter behind.
Model WienerHammersteinBuilder::with_own_static_block(const Model& surrogate) const {
  const Eigen::VectorXd& u = data_.records.front().u;
  const std::vector<ChildParameters> parts = top_level_blocks(surrogate);
  const std::size_t place = structure_.static_block;
  const std::vector<Eigen::VectorXd> signals = simulate_signals(surrogate, u);
  const Record curve = curve_of(signals[place], signals[place + 1]);
  const AnyBlock own = structure_.blocks[place].block.adapted_to(
      {signals[place].data(), static_cast<std::size_t>(signals[place].size())});
  std::vector<LabelledBlock> row = {{"f", own}};
  const Rational* behind = structure_.g_h();
  if (behind != nullptr) row.push_back({"k", Gain()});
  Model start = make_model(Series(std::move(row)));
  const double spread = standard_deviation(curve.y) / std::max(standard_deviation(curve.u), 1e-300);
  if (behind != nullptr) start.parameters[own.parameter_count()] = std::isfinite(spread) ? spread : 1.0;
  const Model fitted = fitted_to_curve(start, own.parameter_count(), curve);

  Model result = surrogate;
  std::vector<LabelledBlock> blocks = structure_.blocks;
  blocks[place].block = own;
  std::vector<double> theta;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Eigen::VectorXd part = parts[k].parameters;
    if (k == place) part = fitted.parameters.head(own.parameter_count());
    if (structure_.second_filter == k) part.head(behind->nb() + 1) *= fitted.parameters[own.parameter_count()];
    theta.insert(theta.end(), part.begin(), part.end());
  }
  result.chain = Series(std::move(blocks));
  result.parameters = Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()));
  return result;
}

/// The plain model with its static block oversampled as the chain's, and fitted anew where least squares can.
Model WienerHammersteinBuilder::with_own_oversampling(const Model& plain) const {
  Model model = plain;
  const bool single = chain_.target<Series>() == nullptr;
  model.chain = with_oversampling_of(single ? AnyBlock(Series({{"", chain_}})) : chain_, plain.chain);
  return affine_ ? fit_static(model, data_, prediction_).model : model;
}

std::vector<Candidate> WienerHammersteinBuilder::finished(std::vector<Candidate> candidates, Index keep) const {
  std::erase_if(candidates, [](const Candidate& c) { return !std::isfinite(c.rmse); });
  std::stable_sort(candidates.begin(), candidates.end(), lower_error);
  if (std::ssize(candidates) > keep) candidates.erase(candidates.begin() + keep, candidates.end());
  if (plain()) return candidates;
  for (Candidate& candidate : candidates) {
    if (!affine_) candidate.model = with_own_static_block(candidate.model);
    if (oversampled_) candidate.model = with_own_oversampling(candidate.model);
    const Predictor predictor(candidate.model.chain, data_, prediction_);
    const double sum = predictor.sum_of_squares(detail::unknowns_of(candidate.model, predictor));
    candidate.rmse = std::sqrt(sum / static_cast<double>(predictor.counted_samples()));
  }
  std::stable_sort(candidates.begin(), candidates.end(), lower_error);
  return candidates;
}

}  // namespace blockid
