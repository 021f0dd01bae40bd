#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/init/detail/candidate_loop.hpp>
#include <blockid/init/detail/watched.hpp>
#include <blockid/init/root_moves.hpp>
#include <blockid/init/root_search.hpp>
#include <blockid/init/wh_builder.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

namespace blockid {
namespace {

/// Two models whose errors differ by less are taken for the same minimum.
constexpr double kSameMinimum = 1e-4;

/// A refitted model, and whether its neighbours have been tried.
struct Found {
  Candidate candidate;
  bool searched = false;
};

void keep_best(std::vector<Candidate>& candidates, int count) {
  std::stable_sort(candidates.begin(), candidates.end(), lower_error);
  if (std::ssize(candidates) > count) candidates.erase(candidates.begin() + count, candidates.end());
}

/// The search on one chain and data set.
class RootSearch {
 public:
  RootSearch(const WienerHammersteinBuilder& builder, const DataSet& data, const InitialiserOptions& options,
             const RootSearchOptions& settings)
      : builder_(builder), data_(data), options_(detail::watched(options, cancelled_)), settings_(settings) {}

  /// Refits the candidates and searches around the best.
  std::vector<Candidate> run(std::vector<Candidate> starts) {
    keep_best(starts, settings_.starts);
    add(refitted(starts, settings_.iterations, "refits of the starts"));
    for (int round = 0; round < settings_.rounds && !*cancelled_; ++round) {
      Found* next = most_promising();
      if (next == nullptr) break;
      next->searched = true;
      const Candidate centre = next->candidate;
      std::vector<Candidate> race = refitted(moved(centre), settings_.first_iterations, "neighbours");
      keep_best(race, settings_.survivors);
      add(refitted(race, settings_.iterations, "best neighbours"));
    }
    std::vector<Candidate> result;
    for (Found& found : found_) result.push_back(std::move(found.candidate));
    return result;
  }

 private:
  std::vector<Candidate> refitted(const std::vector<Candidate>& starts, int iterations, const std::string& stage) {
    RefitOptions refit_options;
    refit_options.prediction = options_.prediction;
    refit_options.max_iterations = iterations;
    refit_options.covariance = false;
    return detail::candidate_loop(
        starts.size(), "root search, " + stage, options_, [&](std::size_t k) -> std::optional<Candidate> {
          if (!std::isfinite(starts[k].rmse)) return std::nullopt;
          const RefitReport report = refit(starts[k].model, data_, refit_options);
          if (!std::isfinite(report.rmse)) return std::nullopt;
          return Candidate{report.model, report.rmse, starts[k].how, {}, starts[k].iterations + report.iterations};
        });
  }

  /// One candidate for each neighbour.
  std::vector<Candidate> moved(const Candidate& centre) const {
    const WienerHammersteinStructure& structure = builder_.structure();
    const std::vector<ChildParameters> blocks = top_level_blocks(centre.model);
    const PlacedRoots placed{roots_of(blocks[*structure.first_filter].parameters, structure.g_w()->nb()),
                             roots_of(blocks[*structure.second_filter].parameters, structure.g_h()->nb())};
    std::vector<Candidate> result;
    for (const PlacedRoots& roots : neighbours(placed)) {
      result.push_back(builder_.build(filter_parameters(*structure.g_w(), roots.first.zeros, roots.first.poles),
                                      filter_parameters(*structure.g_h(), roots.second.zeros, roots.second.poles),
                                      centre.how + "; " + roots.how));
      result.back().iterations = centre.iterations;
    }
    return result;
  }

  /// Models that are not at a minimum known already join the others, best first.
  void add(std::vector<Candidate> candidates) {
    for (Candidate& candidate : candidates) {
      const bool known = std::any_of(found_.begin(), found_.end(), [&](const Found& found) {
        return std::abs(candidate.rmse - found.candidate.rmse) <= kSameMinimum * found.candidate.rmse;
      });
      if (!known) found_.push_back({std::move(candidate)});
    }
    std::stable_sort(found_.begin(), found_.end(),
                     [](const Found& a, const Found& b) { return lower_error(a.candidate, b.candidate); });
  }

  /// The best of the first few that has not been searched; null when all have been.
  Found* most_promising() {
    const auto end = found_.begin() + std::min<std::ptrdiff_t>(settings_.width, std::ssize(found_));
    const auto place = std::find_if(found_.begin(), end, [](const Found& found) { return !found.searched; });
    return place == end ? nullptr : &*place;
  }

  const std::shared_ptr<bool> cancelled_ = std::make_shared<bool>(false);
  const WienerHammersteinBuilder& builder_;
  const DataSet& data_;
  InitialiserOptions options_;
  RootSearchOptions settings_;
  std::vector<Found> found_;
};

std::vector<Candidate> searched(std::vector<Candidate> starts, const AnyBlock& chain, const DataSet& data,
                                const InitialiserOptions& options, const RootSearchOptions& settings) {
  const DataSet part = first_samples(data, settings.samples, options.prediction.warmup);
  const WienerHammersteinBuilder builder(chain, "root_search", part, options.prediction);
  const bool two_filters = builder.structure().g_w() != nullptr && builder.structure().g_h() != nullptr;
  if (!two_filters || !builder.plain() || starts.empty()) return starts;
  std::vector<Candidate> found = RootSearch(builder, part, options, settings).run(starts);
  return found.empty() ? starts : builder.finished(std::move(found), settings.keep);
}

}  // namespace

Initialiser root_search(Initialiser initialiser, RootSearchOptions options) {
  if (options.starts < 1 || options.rounds < 0 || options.width < 1 || options.first_iterations < 1 ||
      options.iterations < 1 || options.survivors < 1 || options.samples < 0 || options.keep < 1) {
    fail("root_search: rounds and samples must be >= 0, all other options >= 1");
  }
  return [initialiser = std::move(initialiser), options](const AnyBlock& chain, const DataSet& data,
                                                         const InitialiserOptions& settings) {
    const auto cancelled = std::make_shared<bool>(false);
    const InitialiserOptions watched = detail::watched(settings, cancelled);
    std::vector<Candidate> starts = initialiser(chain, data, watched);
    if (*cancelled) return starts;
    return searched(std::move(starts), chain, data, watched, options);
  };
}

}  // namespace blockid
