#include <blockid/estimators/fit.hpp>

#include <blockid/blocks/curvature_knots.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/elapsed.hpp>
#include <blockid/estimators/detail/parallel_for.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/gauges.hpp>
#include <blockid/estimators/stability.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>

namespace blockid {
namespace {

using detail::Clock;
using detail::seconds_since;
using detail::view;

/// Relative difference of two RMSE that rounding alone may cause.
constexpr double kEqualRmse = 1e-9;

/// The caller's progress function made safe for several threads, with a memory of the cancellation.
class SharedProgress {
 public:
  SharedProgress(ProgressFunction function, Clock::time_point start) : function_(std::move(function)), start_(start) {}

  bool operator()(Progress progress) {
    if (cancelled_) return false;
    if (!function_) return true;
    const std::lock_guard lock(mutex_);
    progress.elapsed_s = seconds_since(start_);
    if (!function_(progress)) cancelled_ = true;
    return !cancelled_;
  }

  bool cancelled() const { return cancelled_; }

 private:
  ProgressFunction function_;
  Clock::time_point start_;
  std::mutex mutex_;
  std::atomic<bool> cancelled_ = false;
};

/// How an unsettled static block is placed for the signal v that reaches it.
using Placement =
    std::function<AnyBlock(const AnyBlock& unsettled, const ChildParameters& current, const Eigen::VectorXd& v)>;

/// As the block itself wishes.
AnyBlock placed_as_wished(const AnyBlock& unsettled, const ChildParameters&, const Eigen::VectorXd& v) {
  return unsettled.adapted_to(view(v));
}

/// Whether the block is a spline that was given no more than a number of knots.
bool leaves_knots_open(const AnyBlock& block) {
  if (block.target<Spline>() == nullptr) return false;
  const Arguments arguments = block.arguments();
  return arguments.size() == 1 && arguments.front().second.front() != '[';
}

/// Splines whose knots are left open where their present curve bends (curvature_knots.hpp), other blocks as they wish.
AnyBlock placed_where_bent(const AnyBlock& unsettled, const ChildParameters& current, const Eigen::VectorXd& v) {
  AnyBlock wished = placed_as_wished(unsettled, current, v);
  const AnyBlock shape = *static_block_of(unsettled);
  if (!leaves_knots_open(shape)) return wished;
  Model f = make_model(*static_block_of(current.block));
  f.parameters = current.parameters;
  const auto curve = [&](double x) { return simulate(f, Eigen::VectorXd::Constant(1, x))[0]; };
  // Between the samples v may go further: the ends are where the block wishes them.
  const std::vector<double>& knots = static_block_of(wished)->target<Spline>()->knots();
  Eigen::VectorXd reached(v.size() + 2);
  reached << v, knots.front(), knots.back();
  const AnyBlock bent = Spline(curvature_knots(view(reached), curve, std::ssize(knots)));
  const auto* oversampled = unsettled.target<Oversampled>();
  return oversampled != nullptr ? AnyBlock(oversampled->around(bent)) : bent;
}

/// The model with the unsettled static blocks of `chain` placed for the signals that reach them now, and fitted anew;
/// nothing when no block moves. Only what least squares can refill is moved.
std::optional<StaticFit> placed_anew(const Model& model, const AnyBlock& chain, const DataSet& data,
                                     const PredictionOptions& options, const Placement& placement) {
  const auto* wanted = chain.target<Series>();
  if (wanted == nullptr || affine_parameters(model.chain).empty()) return std::nullopt;
  const std::vector<ChildParameters> current = top_level_blocks(model);
  const std::vector<Eigen::VectorXd> signals = simulate_signals(model, data.records.front().u);
  // What an estimated state does within the warm-up is anybody's guess: no knots for that.
  const Index skipped = options.initial_state == InitialState::estimated ? options.warmup : 0;
  std::vector<LabelledBlock> blocks;
  bool moved = false;
  for (std::size_t k = 0; k < current.size(); ++k) {
    AnyBlock block = current[k].block;
    const AnyBlock& unsettled = wanted->children()[k].block;
    if (static_block_of(unsettled) && unsettled.is_linear_in_parameters() && signals[k].allFinite()) {
      const Eigen::VectorXd v = signals[k].tail(signals[k].size() - skipped);
      const AnyBlock placed = placement(unsettled, current[k], v);
      if (placed.parameter_count() == block.parameter_count() && placed.arguments() != block.arguments()) {
        block = placed;
        moved = true;
      }
    }
    blocks.push_back({current[k].label, block});
  }
  if (!moved) return std::nullopt;
  Model changed = model;
  changed.chain = Series(std::move(blocks));
  changed.standard_deviations.resize(0);
  StaticFit fitted = fit_static(changed, data, options);
  if (!fitted.finite) return std::nullopt;
  return fitted;
}

double rmse_on(const Model& model, const DataSet& data, const PredictionOptions& options) {
  const Predictor predictor(model.chain, data, options);
  const double sum = predictor.sum_of_squares(detail::unknowns_of(model, predictor));
  return std::sqrt(sum / static_cast<double>(predictor.counted_samples()));
}

/// Whether a child of the chain is a spline with its knots left open, oversampled or not.
bool has_open_knots(const AnyBlock& chain) {
  const std::vector<LabelledBlock> children = chain.children();
  return std::any_of(children.begin(), children.end(), [](const LabelledBlock& child) {
    const std::optional<AnyBlock> shape = static_block_of(child.block);
    return shape && leaves_knots_open(*shape);
  });
}

/// The better of the places that the blocks wish and of the knots where their curves bend; the model itself when
/// nothing moves, or nothing moves for the better.
Model with_knots_moved(const Model& model, const AnyBlock& chain, const DataSet& data,
                       const PredictionOptions& options) {
  const std::optional<StaticFit> wished = placed_anew(model, chain, data, options, placed_as_wished);
  if (has_open_knots(chain)) {
    const std::optional<StaticFit> bent = placed_anew(model, chain, data, options, placed_where_bent);
    if (bent && bent->rmse < (wished ? wished->rmse : rmse_on(model, data, options))) return bent->model;
  }
  return wished ? wished->model : model;
}

RefitOptions round_options(const FitOptions& options, int iterations, const std::string& stage,
                           SharedProgress& progress) {
  RefitOptions round = options.refit;
  round.max_iterations = iterations;
  round.covariance = false;
  const ProgressCallback own = options.refit.progress;
  round.progress = [&progress, stage, own, iterations](const FitProgress& p) {
    const bool go_on = progress({stage, p.iteration, iterations, p.rmse, p.elapsed_s});
    return (!own || own(p)) && go_on;
  };
  return round;
}

bool lower_rmse(const Trial& a, const Trial& b) { return a.refit.rmse < b.refit.rmse; }

/// The first samples of each record; whole records when that would cut a period or leave too little.
DataSet shortened(const DataSet& data, Index samples, Index least) {
  DataSet result;
  for (const Record& record : data.records) {
    const Index length = std::max(samples, least);
    const bool whole = length >= record.u.size() || record.period > 0;
    result.records.push_back(whole ? record : slice(record, 0, length));
  }
  return result;
}

/// First round for the best candidates: a few iterations each on part of the data, on all threads.
void first_round(std::vector<Trial>& trials, std::size_t count, const DataSet& data, const FitOptions& options,
                 SharedProgress& progress) {
  const Index least = options.refit.prediction.warmup + 20 * trials.front().candidate.model.parameters.size();
  const DataSet part = shortened(data, options.first_round_samples, least);
  const int iterations = std::min(options.first_round_iterations, options.refit.max_iterations);
  detail::parallel_for(count, options.threads, [&](std::size_t k) {
    const std::string stage = "candidate " + std::to_string(k + 1) + " of " + std::to_string(count);
    Trial& trial = trials[k];
    trial.refit = refit(trial.candidate.model, part, round_options(options, iterations, stage, progress));
    trial.refitted = true;
    if (total_samples(part) < total_samples(data)) {
      trial.refit.rmse = rmse_on(trial.refit.model, data, options.refit.prediction);
      // What converged on a part has not converged on the whole.
      if (trial.refit.status == FitStatus::converged) trial.refit.status = FitStatus::max_iterations;
    }
  });
  std::stable_sort(trials.begin(), trials.begin() + static_cast<std::ptrdiff_t>(count), lower_rmse);
}

/// What a refit ended with becomes the trial's.
void take(RefitReport&& report, Trial& trial) {
  trial.refit.model = std::move(report.model);
  trial.refit.rmse = report.rmse;
  trial.refit.status = report.status;
  trial.refit.message = std::move(report.message);
  trial.refit.initial_states = std::move(report.initial_states);
}

/// One more refit of a trial; kept only when it does not lose.
void continue_trial(Trial& trial, const Model& start, const DataSet& data, const RefitOptions& settings) {
  RefitReport report = refit(start, data, settings);
  trial.refit.iterations += report.iterations;
  trial.refit.wall_seconds += report.wall_seconds;
  // Equal to rounding is no loss: a search that starts at its minimum reports convergence.
  if (!(report.rmse <= trial.refit.rmse * (1.0 + kEqualRmse))) return;
  trial.refit.free_parameters = report.free_parameters;
  trial.refit.held = report.held;
  take(std::move(report), trial);
}

/// Whether a frozen parameter belongs to what least squares would refill after a move of the knots.
bool freezes_static_block(const Model& model, const std::vector<std::string>& frozen) {
  const std::vector<Index> affine = affine_parameters(model.chain);
  return std::any_of(frozen.begin(), frozen.end(), [&](const std::string& name) {
    return std::binary_search(affine.begin(), affine.end(), parameter_index(model, name));
  });
}

/// Final round: knots in step with the signal, then Levenberg-Marquardt to the end.
void final_round(Trial& trial, std::size_t place, const AnyBlock& chain, const DataSet& data, const FitOptions& options,
                 SharedProgress& progress) {
  const std::string stage = "finalist " + std::to_string(place + 1);
  const auto iterations_left = [&] { return std::max(options.refit.max_iterations - trial.refit.iterations, 0); };
  const bool frozen_shape = freezes_static_block(trial.refit.model, options.refit.frozen);
  for (int round = 0; !frozen_shape && round < options.knot_rounds && !progress.cancelled() && iterations_left() > 0;
       ++round) {
    const Model moved = with_knots_moved(trial.refit.model, chain, data, options.refit.prediction);
    const bool same = moved.chain.parameter_count() == trial.refit.model.chain.parameter_count() &&
                      moved.parameters == trial.refit.model.parameters;
    if (same) break;
    const int iterations = std::min(options.knot_round_iterations, iterations_left());
    continue_trial(trial, moved, data, round_options(options, iterations, stage, progress));
  }
  if (progress.cancelled() || iterations_left() == 0 || trial.refit.status == FitStatus::converged) return;
  continue_trial(trial, trial.refit.model, data, round_options(options, iterations_left(), stage, progress));
}

/// An unstable model gives way to a stable one up to this factor of its RMSE.
constexpr double kStableWorth = 1.02;

/// A trial that ended with a pole outside the circle goes on from the reflected pole, first free, then with the
/// denominator frozen; kept when that ends stable and as good. Frozen parameters and bounds are the caller's word: they
/// stay.
void stabilise(Trial& trial, std::size_t place, const DataSet& data, const FitOptions& options,
               SharedProgress& progress) {
  const std::vector<std::string> denominators = unstable_denominators(trial.refit.model);
  if (denominators.empty() || !options.refit.frozen.empty() || options.refit.bounds) return;
  Model reflected = with_reflected_poles(trial.refit.model);
  if (!affine_parameters(reflected.chain).empty()) {
    reflected = fit_static(reflected, data, options.refit.prediction).model;
  }
  const std::string stage = "finalist " + std::to_string(place + 1) + ", poles reflected";
  RefitOptions settings = round_options(options, options.refit.max_iterations, stage, progress);
  for (const std::vector<std::string>& frozen : {std::vector<std::string>{}, denominators}) {
    if (progress.cancelled()) return;
    settings.frozen = frozen;
    RefitReport report = refit(reflected, data, settings);
    trial.refit.iterations += report.iterations;
    trial.refit.wall_seconds += report.wall_seconds;
    if (!is_stable(report.model) || !(report.rmse <= kStableWorth * trial.refit.rmse)) continue;
    take(std::move(report), trial);
    return;
  }
}

/// The best trial in front; a stable one instead when it is as good.
void rank(std::vector<Trial>& trials, std::size_t count) {
  const auto last = trials.begin() + static_cast<std::ptrdiff_t>(count);
  std::stable_sort(trials.begin(), last, lower_rmse);
  const double limit = kStableWorth * trials.front().refit.rmse;
  const auto stable = std::find_if(trials.begin(), last, [&](const Trial& trial) {
    return trial.refit.rmse <= limit && is_stable(trial.refit.model);
  });
  if (stable != last) std::rotate(trials.begin(), stable, stable + 1);
}

/// What the data do not touch in line with its neighbours, gains by convention, and the covariance in those
/// coordinates.
void finish(FitResult& result, const DataSet& data, const FitOptions& options) {
  RefitReport& report = result.report;
  if (options.refit.frozen.empty() && !options.refit.bounds) {
    report.model = with_untouched_straightened(report.model, data, options.refit.prediction);
  }
  // Another gain would change what the caller froze.
  if (options.refit.hold_gauges && options.refit.frozen.empty()) {
    Model with_state = report.model;
    report.model = normalise(report.model);
    for (Eigen::VectorXd& state : report.initial_states) {
      with_state.initial_state = state;
      state = normalise(with_state).initial_state;
    }
  }
  if (options.refit.covariance) {
    CovarianceOptions settings;
    settings.prediction = options.refit.prediction;
    settings.frozen = options.refit.frozen;
    settings.hold_gauges = options.refit.hold_gauges;
    settings.initial_states = report.initial_states;
    report.covariance = covariance(report.model, data, settings);
    report.model.standard_deviations = report.covariance->standard_deviations;
  }
  result.model = report.model;
}

Candidate fallback(const AnyBlock& chain, const DataSet& data, const FitOptions& options) {
  InitialiserOptions settings;
  settings.prediction = options.refit.prediction;
  return no_initialiser()(chain, data, settings).front();
}

}  // namespace

FitResult fit(const AnyBlock& chain, const DataSet& data, const Initialiser& initialiser, const FitOptions& options) {
  const Clock::time_point began = Clock::now();
  if (options.best < 1) fail("fit: at least one candidate must be refitted, got best = ", options.best);
  check(data);
  check_excitation(data);
  check_sample_count(data, chain.parameter_count());
  SharedProgress progress(options.progress, began);
  InitialiserOptions settings{options.refit.prediction, options.seed, options.threads,
                              [&progress](const Progress& p) { return progress(p); }};
  std::vector<Candidate> candidates = initialiser(chain, data, settings);
  if (candidates.empty()) candidates.push_back(fallback(chain, data, options));

  FitResult result{.model = candidates.front().model, .report = {.model = candidates.front().model}};
  for (Candidate& candidate : candidates) {
    RefitReport untouched{.model = candidate.model};
    untouched.status = FitStatus::cancelled;
    untouched.rmse = candidate.rmse;
    untouched.initial_rmse = candidate.rmse;
    result.trials.push_back({std::move(candidate), std::move(untouched)});
  }
  const std::size_t count = std::min(result.trials.size(), static_cast<std::size_t>(options.best));
  first_round(result.trials, count, data, options, progress);
  const std::size_t finalists = std::min(count, static_cast<std::size_t>(std::max(options.finalists, 1)));
  detail::parallel_for(finalists, options.threads, [&](std::size_t k) {
    final_round(result.trials[k], k, chain, data, options, progress);
    stabilise(result.trials[k], k, data, options, progress);
  });
  rank(result.trials, count);
  result.report = result.trials.front().refit;
  if (progress.cancelled()) result.report.status = FitStatus::cancelled;
  finish(result, data, options);
  result.wall_seconds = seconds_since(began);
  result.report.wall_seconds = result.wall_seconds;
  return result;
}

}  // namespace blockid
