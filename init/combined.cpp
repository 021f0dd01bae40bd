#include <blockid/init/combined.hpp>
#include <blockid/init/detail/repeated.hpp>
#include <blockid/init/special_cases.hpp>
#include <blockid/init/split.hpp>
#include <blockid/init/wh_structure.hpp>

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

namespace blockid {
namespace {

/// The caller's progress function with a memory of its cancellation.
InitialiserOptions watched(const InitialiserOptions& options, const std::shared_ptr<bool>& cancelled) {
  InitialiserOptions result = options;
  if (options.progress) {
    result.progress = [progress = options.progress, cancelled](const Progress& p) {
      if (!progress(p)) *cancelled = true;
      return !*cancelled;
    };
  }
  return result;
}

}  // namespace

Initialiser combined(std::vector<Initialiser> initialisers) {
  return [initialisers](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options) {
    const auto cancelled = std::make_shared<bool>(false);
    const InitialiserOptions settings = watched(options, cancelled);
    std::vector<Candidate> all;
    for (const Initialiser& initialiser : initialisers) {
      if (*cancelled) break;
      std::vector<Candidate> some = initialiser(chain, data, settings);
      std::move(some.begin(), some.end(), std::back_inserter(all));
    }
    std::stable_sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) { return a.rmse < b.rmse; });
    return detail::without_repeated(std::move(all));
  };
}

Initialiser fractional(FractionalOptions options) {
  const Initialiser both = combined({release(options.release), classify(options.classify),
                                     exhaustive_split(options.split), wiener_and_hammerstein()});
  return [both](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    const WienerHammersteinStructure structure = wiener_hammerstein_structure(chain, "fractional");
    const bool one_filter = !structure.first_filter || !structure.second_filter;
    return (one_filter ? exhaustive_split() : both)(chain, data, settings);
  };
}

}  // namespace blockid
