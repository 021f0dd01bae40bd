#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/init/automatic.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/combined.hpp>
#include <blockid/init/wh_builder.hpp>
#include <blockid/init/wh_structure.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

namespace blockid {
namespace {

constexpr Index kFewestSamples = 100;
/// Validation starts in the middle of a run: the models' states settle over so many samples, a tenth of it at most.
constexpr Index kSettling = 500;
/// Iterations of a fit that only compares structures.
constexpr int kComparisonIterations = 80;
/// Samples that the table of delays is made of.
constexpr Index kDelaySamples = 10000;
constexpr Index kDelayOrder = 6;
/// The smallest delay whose linear model is within this share of the best one: numerators take up the rest.
constexpr double kDelayTolerance = 0.02;
constexpr Index kOversampling[] = {2, 4, 8};
constexpr Index kFirstKnots = 20;
constexpr Index kMoreKnots[] = {30, 45};

/// What distinguishes the chains.
struct Structure {
  Index first = 1;
  Index second = 1;
  Index delay = 0;
  Index knots = kFirstKnots;
  /// 1: at the samples only.
  Index oversampling = 1;
};

/// The chains that structures stand for: the blocks of a given one with filters of other degrees, or all that is chosen
/// freely.
class Family {
 public:
  Family() = default;
  explicit Family(WienerHammersteinStructure given) : given_(std::move(given)) {}

  bool has_first() const { return !given_ || given_->first_filter; }
  bool has_second() const { return !given_ || given_->second_filter; }
  bool chooses_static_block() const { return !given_; }

  AnyBlock chain(const Structure& structure) const {
    const Rational first(structure.first, structure.first, structure.delay);
    const Rational second(structure.second, structure.second, has_first() ? 0 : structure.delay);
    if (given_) {
      std::vector<LabelledBlock> blocks = given_->blocks;
      if (given_->first_filter) blocks[*given_->first_filter].block = first;
      if (given_->second_filter) blocks[*given_->second_filter].block = second;
      return Series(std::move(blocks));
    }
    const AnyBlock spline = Spline(structure.knots);
    const AnyBlock f = structure.oversampling > 1 ? AnyBlock(Oversampled(spline, structure.oversampling)) : spline;
    return Series({{"G1", first}, {"f", f}, {"G2", second}});
  }

 private:
  std::optional<WienerHammersteinStructure> given_;
};

struct Parts {
  DataSet train;
  DataSet validation;
};

/// Whole periods on either side where the record is periodic.
Index cut_of(const Record& record, double share) {
  const Index length = record.u.size();
  const auto cut = static_cast<Index>((1.0 - share) * static_cast<double>(length));
  if (record.period <= 0) return cut;
  return std::clamp<Index>(cut / record.period * record.period, record.period, length);
}

Parts held_back(const DataSet& data, double share) {
  Parts parts;
  for (const Record& record : data.records) {
    const Index length = record.u.size();
    if (length < kFewestSamples) {
      fail("choice of structure: expected records of ", kFewestSamples, " samples or more to hold back a part, got ",
           length);
    }
    const Index cut = cut_of(record, share);
    parts.train.records.push_back(slice(record, 0, cut));
    if (cut < length) parts.validation.records.push_back(slice(record, cut, length));
  }
  return parts;
}

/// The coefficients of a filter with more degrees: zero for those that are new.
Eigen::VectorXd grown(const Eigen::VectorXd& theta, Index from, Index to) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(2 * to + 1);
  result.head(from + 1) = theta.head(from + 1);
  result.segment(to + 1, from) = theta.tail(from);
  return result;
}

/// The filters of a fitted model as the start of another structure.
Initialiser start_from_filters(const Family& family, const Model& model, const Structure& from, const Structure& to) {
  const std::vector<ChildParameters> blocks = top_level_blocks(model);
  Eigen::VectorXd first;
  Eigen::VectorXd second;
  if (family.has_first()) first = grown(blocks.front().parameters, from.first, to.first);
  if (family.has_second()) second = grown(blocks.back().parameters, from.second, to.second);
  return [first, second](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options) {
    const DataSet part = first_samples(data, 20000, options.prediction.warmup);
    const WienerHammersteinBuilder builder(chain, "fit_wiener_hammerstein", part, options.prediction);
    return builder.finished({builder.build(first, second, "filters of a smaller model")}, 1);
  };
}

/// The search over structures.
class StructureSearch {
 public:
  StructureSearch(Family family, Initialiser first_start, const DataSet& data, const AutomaticOptions& options)
      : family_(std::move(family)),
        first_start_(std::move(first_start)),
        options_(options),
        cancelled_(std::make_shared<bool>(false)),
        fit_(options.fit) {
    DataSet part = first_samples(data, options.samples, 0);
    Parts parts = held_back(part, options.validation_share);
    train_ = std::move(parts.train);
    validation_ = parts.validation.records.empty() ? train_ : std::move(parts.validation);
    fit_.refit.covariance = false;
    fit_.refit.max_iterations = std::min(fit_.refit.max_iterations, kComparisonIterations);
    fit_.finalists = 1;
    if (options.fit.progress) {
      fit_.progress = [progress = options.fit.progress, cancelled = cancelled_, this](const Progress& p) {
        Progress named = p;
        named.stage = stage_ + ": " + p.stage;
        if (!progress(named)) *cancelled = true;
        return !*cancelled;
      };
    }
  }

  bool cancelled() const { return *cancelled_; }
  const std::optional<FitResult>& best() const { return best_; }
  const Structure& structure() const { return structure_; }
  const std::vector<StructureScore>& tried() const { return tried_; }

  void run() {
    Structure next;
    next.delay = delay();
    for (Index order = 1; order <= options_.max_order && !cancelled(); ++order) {
      next.first = next.second = order;
      const bool better = consider(next, first_start_);
      // One order may fail to help where the next one does.
      if (!better && structure_.first <= order - 2) break;
    }
    if (family_.chooses_static_block()) grow_static_block();
    for (bool improved = true; improved && !cancelled();) improved = grow_second() || grow_first();
  }

 private:
  void grow_static_block() {
    for (const Index knots : kMoreKnots) {
      Structure next = structure_;
      next.knots = knots;
      if (cancelled() || !consider(next)) break;
    }
    for (const Index factor : kOversampling) {
      Structure next = structure_;
      next.oversampling = factor;
      if (cancelled() || !consider(next)) break;
    }
  }

  bool grow_second() {
    Structure next = structure_;
    ++next.second;
    return family_.has_second() && next.second <= options_.max_order && consider(next);
  }

  bool grow_first() {
    if (cancelled()) return false;
    Structure next = structure_;
    ++next.first;
    return family_.has_first() && next.first <= options_.max_order && consider(next);
  }

  bool consider(const Structure& structure) {
    return consider(structure, start_from_filters(family_, best_->model, structure_, structure));
  }

  Index delay() const {
    BlaOptions options;
    options.prediction = options_.fit.refit.prediction;
    const std::vector<BlaScore> table =
        bla_order_table(first_samples(train_, kDelaySamples, 0), first_samples(validation_, kDelaySamples, 0),
                        kDelayOrder, options_.max_delay, options, options_.fit.threads);
    std::vector<double> best(static_cast<std::size_t>(options_.max_delay) + 1, std::numeric_limits<double>::infinity());
    for (const BlaScore& score : table) {
      double& least = best[static_cast<std::size_t>(score.orders.nk)];
      if (score.validation_rmse < least) least = score.validation_rmse;
    }
    const double limit = (1.0 + kDelayTolerance) * *std::min_element(best.begin(), best.end());
    return std::find_if(best.begin(), best.end(), [&](double rmse) { return rmse <= limit; }) - best.begin();
  }

  double validation_rmse(const Model& model) const {
    PredictionOptions prediction = options_.fit.refit.prediction;
    if (prediction.initial_state == InitialState::zero) {
      Index shortest = validation_.records.front().u.size();
      for (const Record& record : validation_.records) shortest = std::min(shortest, record.u.size());
      prediction.warmup = std::max(std::min(kSettling, shortest / 10), std::min(prediction.warmup, shortest / 2));
    }
    double sum = 0.0;
    Index count = 0;
    for (const Record& record : validation_.records) {
      const DataSet one(record);
      const Model started = placed_on(model, record, prediction);
      const Predictor predictor(started.chain, one, prediction);
      sum += predictor.sum_of_squares(detail::unknowns_of(started, predictor));
      count += predictor.counted_samples();
    }
    const double rmse = std::sqrt(sum / static_cast<double>(count));
    return std::isfinite(rmse) ? rmse : std::numeric_limits<double>::infinity();
  }

  /// Fits the structure; taken when it lowers the validation error by enough.
  bool consider(const Structure& structure, const Initialiser& initialiser) {
    const AnyBlock chain = family_.chain(structure);
    stage_ = to_text(chain);
    FitResult fitted = fit(chain, train_, initialiser, fit_);
    const double rmse = validation_rmse(fitted.model);
    const bool better = !best_ || rmse < (1.0 - options_.improvement) * best_rmse_;
    tried_.push_back({stage_, rmse, fitted.report.free_parameters, better});
    if (!better) return false;
    best_ = std::move(fitted);
    best_rmse_ = rmse;
    structure_ = structure;
    return true;
  }

  Family family_;
  /// Of chains whose filters both have one degree more than before.
  Initialiser first_start_;
  AutomaticOptions options_;
  std::shared_ptr<bool> cancelled_;
  FitOptions fit_;
  DataSet train_;
  DataSet validation_;
  std::string stage_;
  Structure structure_;
  std::optional<FitResult> best_;
  double best_rmse_ = std::numeric_limits<double>::infinity();
  std::vector<StructureScore> tried_;
};

AutomaticResult search(const std::string& who, const Family& family, const Initialiser& initialiser,
                       const DataSet& data, const AutomaticOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  if (options.max_order < 1 || options.max_delay < 0 || options.samples < 0 || !(options.validation_share > 0.0) ||
      !(options.validation_share < 1.0) || !(options.improvement >= 0.0)) {
    fail(who, ": max_order must be >= 1, max_delay, samples and improvement >= 0, validation_share within (0, 1)");
  }
  StructureSearch search(family, initialiser, data, options);
  search.run();
  const AnyBlock chain = family.chain(search.structure());
  AutomaticResult result{*search.best(), to_text(chain), search.tried()};
  if (!search.cancelled()) {
    const Initialiser start = start_from_filters(family, search.best()->model, search.structure(), search.structure());
    result.fit = fit(chain, data, start, options.fit);
  }
  result.fit.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  return result;
}

}  // namespace

AutomaticResult fit_wiener_hammerstein(const DataSet& data, const AutomaticOptions& options) {
  return search("fit_wiener_hammerstein", {}, fractional({.random_stages = 0}), data, options);
}

AutomaticResult fit_with_chosen_orders(const AnyBlock& chain, const DataSet& data, const AutomaticOptions& options,
                                       const Initialiser& initialiser) {
  const WienerHammersteinStructure given = wiener_hammerstein_structure(chain, "fit_with_chosen_orders");
  if (!given.first_filter && !given.second_filter) {
    fail("fit_with_chosen_orders: expected a chain with a rational filter whose degrees can be chosen, got ",
         to_text(chain));
  }
  return search("fit_with_chosen_orders", Family(given), initialiser, data, options);
}

}  // namespace blockid
