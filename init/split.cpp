#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/parallel_for.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/estimators/static_parameters.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/split.hpp>
#include <blockid/init/wh_structure.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

namespace blockid {
namespace {

/// Knots of the spline that stands in for a static block that is not linear in its parameters.
constexpr Index kSurrogateKnots = 12;
/// Samples of its curve that such a block is then fitted to.
constexpr Index kCurveSamples = 400;

/// Which groups go to G_W; the others go to G_H.
using Choice = std::vector<bool>;

/// All choices whose degrees add up to `wanted`, by depth-first search.
void choices_from(const std::vector<RootGroup>& groups, Index wanted, Choice& chosen, std::vector<Choice>& found) {
  const std::size_t next = chosen.size();
  if (next == groups.size()) {
    if (wanted == 0) found.push_back(chosen);
    return;
  }
  for (const bool take : {true, false}) {
    const Index rest = wanted - (take ? groups[next].degree() : 0);
    if (rest < 0) continue;
    chosen.push_back(take);
    choices_from(groups, rest, chosen, found);
    chosen.pop_back();
  }
}

struct Partition {
  std::vector<RootGroup> groups;
  std::vector<Choice> choices;
};

/// Choices of degree `first` out of groups; pairs are broken, most damped first, until there is one.
Partition partitions(std::vector<RootGroup> groups, Index first) {
  for (;;) {
    Partition result{groups, {}};
    Choice chosen;
    choices_from(groups, first, chosen, result.choices);
    if (!result.choices.empty()) return result;
    const auto pair = std::min_element(groups.begin(), groups.end(), [](const RootGroup& a, const RootGroup& b) {
      const auto key = [](const RootGroup& g) {
        return g.kind == RootGroup::Kind::pair ? std::abs(std::arg(g.value)) : std::numeric_limits<double>::infinity();
      };
      return key(a) < key(b);
    });
    if (pair == groups.end() || pair->kind != RootGroup::Kind::pair) return result;
    const std::vector<RootGroup> halves = broken_pair(*pair);
    groups.erase(pair);
    groups.insert(groups.end(), halves.begin(), halves.end());
  }
}

std::vector<RootGroup> selected(const std::vector<RootGroup>& groups, const Choice& choice, bool first) {
  std::vector<RootGroup> result;
  for (std::size_t k = 0; k < groups.size(); ++k) {
    if (choice[k] == first) result.push_back(groups[k]);
  }
  return result;
}

/// theta = [b, a] of a rational filter with the given zeros and poles.
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

Eigen::VectorXd filtered(const Rational& filter, const Eigen::VectorXd& theta, const Eigen::VectorXd& u) {
  Model model = make_model(filter);
  model.parameters = theta;
  return simulate(model, u);
}

double standard_deviation(const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

/// The first samples behind the warm-up of each record; the whole record where that would cut its period.
DataSet first_samples(const DataSet& data, Index samples, Index warmup) {
  if (samples <= 0) return data;
  DataSet result;
  for (const Record& record : data.records) {
    const bool whole = samples + warmup >= record.u.size() || samples + warmup < record.period;
    result.records.push_back(whole ? record : slice(record, 0, samples + warmup));
  }
  return result;
}

bool lower_error(const Candidate& a, const Candidate& b) { return a.rmse < b.rmse; }

/// Builds the model of one partition: filters of unit output deviation, static block placed and fitted.
class ModelBuilder {
 public:
  ModelBuilder(const WienerHammersteinStructure& structure, const DataSet& data, const PredictionOptions& prediction)
      : structure_(structure),
        data_(data),
        prediction_(prediction),
        affine_(structure.blocks[structure.static_block].block.is_linear_in_parameters()) {}

  /// Whether the chain's own static block is fitted, or a spline in its place.
  bool is_affine() const { return affine_; }

  StaticFit build(const Eigen::VectorXd& first, const Eigen::VectorXd& second) const {
    std::vector<LabelledBlock> blocks = structure_.blocks;
    if (!affine_) blocks[structure_.static_block].block = Spline(kSurrogateKnots);
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
    f = f.adapted_to({v.data(), static_cast<std::size_t>(v.size())});
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

 private:
  static StaticFit failed(const std::vector<LabelledBlock>& blocks) {
    return {make_model(Series(blocks)), std::numeric_limits<double>::infinity(), 0, 0.0, false};
  }

  const WienerHammersteinStructure& structure_;
  const DataSet& data_;
  PredictionOptions prediction_;
  bool affine_;
};

/// The chain's own static block in place of the surrogate spline: fitted with a gain behind it to the spline's curve
/// over the signal that reaches it; the gain goes into the filter behind.
Model with_own_static_block(const Model& surrogate, const WienerHammersteinStructure& structure,
                            const Eigen::VectorXd& u) {
  const std::vector<ChildParameters> parts = top_level_blocks(surrogate);
  const std::size_t place = structure.static_block;
  const std::vector<Eigen::VectorXd> signals = simulate_signals(surrogate, u);
  Record curve;
  const Index step = std::max<Index>(1, u.size() / kCurveSamples);
  const Index samples = u.size() / step;
  curve.u = Eigen::VectorXd(samples);
  curve.y = Eigen::VectorXd(samples);
  for (Index k = 0; k < samples; ++k) {
    curve.u[k] = signals[place][k * step];
    curve.y[k] = signals[place + 1][k * step];
  }
  const AnyBlock own = structure.blocks[place].block.adapted_to(
      {signals[place].data(), static_cast<std::size_t>(signals[place].size())});
  std::vector<LabelledBlock> row = {{"f", own}};
  const Rational* behind = structure.g_h();
  if (behind != nullptr) row.push_back({"k", Gain()});
  Model start = make_model(Series(std::move(row)));
  const double spread = standard_deviation(curve.y) / std::max(standard_deviation(curve.u), 1e-300);
  if (behind != nullptr) start.parameters[own.parameter_count()] = std::isfinite(spread) ? spread : 1.0;
  RefitOptions settings;
  settings.max_iterations = 100;
  settings.covariance = false;
  const Model fitted = refit(start, curve, settings).model;

  Model result = surrogate;
  std::vector<LabelledBlock> blocks = structure.blocks;
  blocks[place].block = own;
  std::vector<double> theta;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    Eigen::VectorXd part = parts[k].parameters;
    if (k == place) part = fitted.parameters.head(own.parameter_count());
    if (structure.second_filter == k) part.head(behind->nb() + 1) *= fitted.parameters[own.parameter_count()];
    theta.insert(theta.end(), part.begin(), part.end());
  }
  result.chain = Series(std::move(blocks));
  result.parameters = Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()));
  return result;
}

struct Pair {
  std::size_t zeros;
  std::size_t poles;
};

/// Every combination of a choice of zeros and a choice of poles, thinned out evenly to `limit`.
std::vector<Pair> combinations(std::size_t zeros, std::size_t poles, Index limit) {
  const std::size_t total = zeros * poles;
  const std::size_t count = std::min(total, static_cast<std::size_t>(limit));
  std::vector<Pair> result;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t pick = k * total / count;
    result.push_back({pick / poles, pick % poles});
  }
  return result;
}

Index nb_of(const Rational* filter) { return filter == nullptr ? 0 : filter->nb(); }
Index na_of(const Rational* filter) { return filter == nullptr ? 0 : filter->na(); }
Index nk_of(const Rational* filter) { return filter == nullptr ? 0 : filter->nk(); }

std::vector<Candidate> split(const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options,
                             const SplitOptions& split_options) {
  if (split_options.max_partitions < 1 || split_options.keep < 1 || split_options.ranking_samples < 0) {
    fail("exhaustive_split: max_partitions and keep must be >= 1 and ranking_samples >= 0");
  }
  const WienerHammersteinStructure structure = wiener_hammerstein_structure(chain, "exhaustive_split");
  const Rational* g_w = structure.g_w();
  const Rational* g_h = structure.g_h();
  const DataSet ranking = first_samples(data, split_options.ranking_samples, options.prediction.warmup);

  BlaOptions bla_options;
  bla_options.prediction = options.prediction;
  bla_options.progress = options.progress;
  const BlaOrders orders{nb_of(g_w) + nb_of(g_h), na_of(g_w) + na_of(g_h), nk_of(g_w) + nk_of(g_h)};
  const BestLinearApproximation bla = best_linear_approximation(data, orders, bla_options);
  if (bla.refit.status == FitStatus::cancelled) return {};

  const Partition zeros = partitions(bla.zeros, nb_of(g_w));
  const Partition poles = partitions(bla.poles, na_of(g_w));
  const std::vector<Pair> pairs =
      combinations(zeros.choices.size(), poles.choices.size(), split_options.max_partitions);
  const ModelBuilder builder(structure, ranking, options.prediction);
  std::vector<Candidate> candidates(pairs.size(), Candidate{bla.model, std::numeric_limits<double>::infinity()});
  std::atomic<Index> done = 0;
  std::atomic<bool> cancelled = false;
  std::mutex progress_mutex;
  double best = std::numeric_limits<double>::infinity();
  detail::parallel_for(pairs.size(), options.threads, [&](std::size_t k) {
    if (cancelled) return;
    const Choice& zero_choice = zeros.choices[pairs[k].zeros];
    const Choice& pole_choice = poles.choices[pairs[k].poles];
    const std::vector<RootGroup> first_zeros = selected(zeros.groups, zero_choice, true);
    const std::vector<RootGroup> first_poles = selected(poles.groups, pole_choice, true);
    const std::vector<RootGroup> second_zeros = selected(zeros.groups, zero_choice, false);
    const std::vector<RootGroup> second_poles = selected(poles.groups, pole_choice, false);
    const StaticFit fitted =
        builder.build(g_w != nullptr ? filter_parameters(*g_w, first_zeros, first_poles) : Eigen::VectorXd(),
                      g_h != nullptr ? filter_parameters(*g_h, second_zeros, second_poles) : Eigen::VectorXd());
    candidates[k] = {fitted.model, fitted.finite ? fitted.rmse : std::numeric_limits<double>::infinity(),
                     "split " + std::to_string(k + 1) + " of " + std::to_string(pairs.size()) + ": zeros " +
                         to_text(first_zeros) + " | " + to_text(second_zeros) + ", poles " + to_text(first_poles) +
                         " | " + to_text(second_poles)};
    ++done;
    const std::lock_guard lock(progress_mutex);
    best = std::min(best, candidates[k].rmse);
    if (options.progress && !options.progress({"splits", done, static_cast<Index>(pairs.size()), best, 0.0})) {
      cancelled = true;
    }
  });
  std::erase_if(candidates, [](const Candidate& c) { return !std::isfinite(c.rmse); });
  std::stable_sort(candidates.begin(), candidates.end(), lower_error);
  if (std::ssize(candidates) > split_options.keep) {
    candidates.erase(candidates.begin() + split_options.keep, candidates.end());
  }
  if (!builder.is_affine()) {
    for (Candidate& candidate : candidates) {
      candidate.model = with_own_static_block(candidate.model, structure, ranking.records.front().u);
      const Predictor predictor(candidate.model.chain, ranking, options.prediction);
      const double sum = predictor.sum_of_squares(detail::unknowns_of(candidate.model, predictor));
      candidate.rmse = std::sqrt(sum / static_cast<double>(predictor.counted_samples()));
    }
    std::stable_sort(candidates.begin(), candidates.end(), lower_error);
  }
  return candidates;
}

}  // namespace

Initialiser exhaustive_split(SplitOptions options) {
  return [options](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    return split(chain, data, settings, options);
  };
}

}  // namespace blockid
