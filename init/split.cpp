#include <blockid/data/error.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/detail/candidate_loop.hpp>
#include <blockid/init/split.hpp>
#include <blockid/init/wh_builder.hpp>
#include <blockid/init/wh_structure.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace blockid {
namespace {

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

std::vector<Candidate> split(const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options,
                             const SplitOptions& split_options) {
  if (split_options.max_partitions < 1 || split_options.keep < 1 || split_options.ranking_samples < 0) {
    fail("exhaustive_split: max_partitions and keep must be >= 1 and ranking_samples >= 0");
  }
  const DataSet ranking = first_samples(data, split_options.ranking_samples, options.prediction.warmup);
  const WienerHammersteinBuilder builder(chain, "exhaustive_split", ranking, options.prediction);
  const Rational* g_w = builder.structure().g_w();
  const Rational* g_h = builder.structure().g_h();

  BlaOptions bla_options;
  bla_options.prediction = options.prediction;
  bla_options.progress = options.progress;
  const BestLinearApproximation bla = best_linear_approximation(data, joint_orders(builder.structure()), bla_options);
  if (bla.refit.status == FitStatus::cancelled) return {};

  const Partition zeros = partitions(bla.zeros, g_w != nullptr ? g_w->nb() : 0);
  const Partition poles = partitions(bla.poles, g_w != nullptr ? g_w->na() : 0);
  const std::vector<Pair> pairs =
      combinations(zeros.choices.size(), poles.choices.size(), split_options.max_partitions);
  std::vector<Candidate> candidates = detail::candidate_loop(pairs.size(), "splits", options, [&](std::size_t k) {
    const Choice& zero_choice = zeros.choices[pairs[k].zeros];
    const Choice& pole_choice = poles.choices[pairs[k].poles];
    const std::vector<RootGroup> first_zeros = selected(zeros.groups, zero_choice, true);
    const std::vector<RootGroup> first_poles = selected(poles.groups, pole_choice, true);
    const std::vector<RootGroup> second_zeros = selected(zeros.groups, zero_choice, false);
    const std::vector<RootGroup> second_poles = selected(poles.groups, pole_choice, false);
    return builder.build(g_w != nullptr ? filter_parameters(*g_w, first_zeros, first_poles) : Eigen::VectorXd(),
                         g_h != nullptr ? filter_parameters(*g_h, second_zeros, second_poles) : Eigen::VectorXd(),
                         "split " + std::to_string(k + 1) + " of " + std::to_string(pairs.size()) + ": zeros " +
                             to_text(first_zeros) + " | " + to_text(second_zeros) + ", poles " + to_text(first_poles) +
                             " | " + to_text(second_poles));
  });
  return builder.finished(std::move(candidates), split_options.keep);
}

}  // namespace

Initialiser exhaustive_split(SplitOptions options) {
  return [options](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    return split(chain, data, settings, options);
  };
}

}  // namespace blockid
