#include <blockid/init/combined.hpp>
#include <blockid/init/detail/repeated.hpp>
#include <blockid/init/detail/watched.hpp>
#include <blockid/init/root_search.hpp>
#include <blockid/init/special_cases.hpp>
#include <blockid/init/split.hpp>
#include <blockid/init/wh_builder.hpp>
#include <blockid/init/wh_structure.hpp>

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

namespace blockid {
namespace {

/// Samples of each record on which the chain's own static block is fitted and ranked.
constexpr Index kExchangeSamples = 20000;

}  // namespace

Initialiser combined(std::vector<Initialiser> initialisers) {
  return [initialisers = std::move(initialisers)](const AnyBlock& chain, const DataSet& data,
                                                  const InitialiserOptions& options) {
    const auto cancelled = std::make_shared<bool>(false);
    const InitialiserOptions settings = detail::watched(options, cancelled);
    std::vector<Candidate> all;
    for (const Initialiser& initialiser : initialisers) {
      if (*cancelled) break;
      std::vector<Candidate> some = initialiser(chain, data, settings);
      std::move(some.begin(), some.end(), std::back_inserter(all));
    }
    std::stable_sort(all.begin(), all.end(), lower_error);
    return detail::without_repeated(std::move(all));
  };
}

Initialiser with_plain_static_block(Initialiser initialiser) {
  return [initialiser = std::move(initialiser)](const AnyBlock& chain, const DataSet& data,
                                                const InitialiserOptions& options) {
    const DataSet part = first_samples(data, kExchangeSamples, options.prediction.warmup);
    const WienerHammersteinBuilder builder(chain, "with_plain_static_block", part, options.prediction);
    std::vector<Candidate> candidates = initialiser(builder.plain_chain(), data, options);
    const Index count = std::ssize(candidates);
    return builder.plain() ? candidates : builder.finished(std::move(candidates), count);
  };
}

Initialiser fractional(FractionalOptions options) {
  const Initialiser roads = combined({release(options.release), classify(options.classify),
                                      exhaustive_split(options.split), wiener_and_hammerstein()});
  std::vector<Initialiser> stages = {with_plain_static_block(root_search(roads, options.search))};
  for (int k = 0; k < options.random_stages; ++k) {
    stages.push_back(with_plain_static_block(root_search(random_starts(options.random), options.random_search)));
  }
  const Initialiser both = escalated(std::move(stages), options.escalation);
  return [both](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    const WienerHammersteinStructure structure = wiener_hammerstein_structure(chain, "fractional");
    const bool one_filter = !structure.first_filter || !structure.second_filter;
    return (one_filter ? exhaustive_split() : both)(chain, data, settings);
  };
}

}  // namespace blockid
