#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/init/detail/candidate_loop.hpp>
#include <blockid/init/detail/watched.hpp>
#include <blockid/init/escalated.hpp>
#include <blockid/init/noise_test.hpp>
#include <blockid/init/wh_builder.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

namespace blockid {
namespace {

/// A refitted candidate, with its initial states where they were estimated.
struct Refitted {
  Candidate candidate;
  std::vector<Eigen::VectorXd> initial_states = {};
};

/// Standard deviation of the outputs that count, over all records.
double output_deviation(const DataSet& data) {
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (const Record& record : data.records) {
    for (Index t = 0; t < record.y.size(); ++t) {
      if (!std::isfinite(record.y[t])) continue;
      sum += record.y[t];
      squares += record.y[t] * record.y[t];
      count += 1.0;
    }
  }
  const double mean = sum / std::max(count, 1.0);
  return std::sqrt(std::max(squares / std::max(count, 1.0) - mean * mean, 0.0));
}

/// The stages on one chain and data set.
class Escalation {
 public:
  Escalation(const DataSet& data, const InitialiserOptions& options, const EscalationOptions& settings)
      : part_(first_samples(data, settings.samples, options.prediction.warmup)),
        options_(options),
        settings_(settings),
        negligible_(settings.negligible * output_deviation(part_)) {}

  /// Refits the best of the candidates, which come best first; those that cannot be refitted are left out.
  void add(const std::vector<Candidate>& candidates, std::size_t stage) {
    const std::size_t count = std::min(candidates.size(), static_cast<std::size_t>(settings_.refits));
    std::vector<std::optional<Refitted>> refits(count);
    detail::candidate_loop(count, "stage " + std::to_string(stage + 1) + ", refits", options_,
                           [&](std::size_t k) -> std::optional<Candidate> {
                             refits[k] = refitted(candidates[k]);
                             if (!refits[k]) return std::nullopt;
                             return refits[k]->candidate;
                           });
    for (std::optional<Refitted>& one : refits) {
      if (one) found_.push_back(std::move(*one));
    }
    std::stable_sort(found_.begin(), found_.end(),
                     [](const Refitted& a, const Refitted& b) { return lower_error(a.candidate, b.candidate); });
  }

  /// Whether the best model leaves nothing to explain.
  bool explained() const {
    if (found_.empty()) return false;
    const Refitted& best = found_.front();
    if (best.candidate.rmse <= negligible_) return true;
    const Predictor predictor(best.candidate.model.chain, part_, options_.prediction);
    return noise_test(predictor, detail::unknowns_of(best.candidate.model, predictor, best.initial_states))
        .like_noise();
  }

  std::vector<Candidate> best() {
    std::vector<Candidate> result;
    for (Refitted& one : found_) {
      if (std::ssize(result) < settings_.keep) result.push_back(std::move(one.candidate));
    }
    return result;
  }

 private:
  std::optional<Refitted> refitted(const Candidate& candidate) const {
    RefitOptions settings;
    settings.prediction = options_.prediction;
    settings.max_iterations = settings_.iterations;
    settings.covariance = false;
    const RefitReport report = refit(candidate.model, part_, settings);
    if (!std::isfinite(report.rmse)) return std::nullopt;
    return Refitted{
        {report.model, report.rmse, candidate.how, candidate.root_shares, candidate.iterations + report.iterations},
        report.initial_states};
  }

  DataSet part_;
  InitialiserOptions options_;
  EscalationOptions settings_;
  double negligible_;
  std::vector<Refitted> found_;
};

}  // namespace

Initialiser escalated(std::vector<Initialiser> stages, EscalationOptions options) {
  if (options.refits < 1 || options.iterations < 1 || options.keep < 1 || options.samples < 0 ||
      !(options.negligible >= 0.0)) {
    fail("escalated: refits, iterations and keep must be >= 1, samples and negligible >= 0");
  }
  return [stages = std::move(stages), options](const AnyBlock& chain, const DataSet& data,
                                               const InitialiserOptions& settings) {
    const auto cancelled = std::make_shared<bool>(false);
    InitialiserOptions watched = detail::watched(settings, cancelled);
    Escalation escalation(data, watched, options);
    for (std::size_t stage = 0; stage < stages.size(); ++stage) {
      watched.seed = settings.seed + stage;
      std::vector<Candidate> candidates = stages[stage](chain, data, watched);
      escalation.add(candidates, stage);
      if (*cancelled || escalation.explained()) break;
    }
    return escalation.best();
  };
}

}  // namespace blockid
