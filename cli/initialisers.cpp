#include <blockid/cli/initialisers.hpp>

#include <blockid/data/error.hpp>
#include <blockid/init/classify.hpp>
#include <blockid/init/combined.hpp>
#include <blockid/init/random_starts.hpp>
#include <blockid/init/release.hpp>
#include <blockid/init/split.hpp>

#include <string_view>

namespace blockid::cli {

namespace {

/// Options with their number of starts replaced unless it is 0.
template <class Options>
Options with_starts(int starts) {
  Options options;
  if (starts > 0) options.starts = starts;
  return options;
}

}  // namespace

std::vector<NamedInitialiser> initialisers() {
  return {
      {"fractional", "exponents of the best linear approximation's roots, by both roads below",
       [](int starts) {
         return fractional(
             {.classify = with_starts<ClassifyOptions>(starts), .release = with_starts<ReleaseOptions>(starts)});
       }},
      {"release", "expansions of both filters set free, then reduced",
       [](int starts) { return release(with_starts<ReleaseOptions>(starts)); }},
      {"classify", "fractional exponents rounded",
       [](int starts) { return classify(with_starts<ClassifyOptions>(starts)); }},
      {"split", "all ways to split the best linear approximation between the filters",
       [](int) { return exhaustive_split(); }},
      {"random", "random stable filters",
       [](int starts) { return random_starts(with_starts<RandomStartsOptions>(starts)); }},
      {"none", "the blocks' own initial parameters", [](int) { return no_initialiser(); }},
  };
}

std::string describe_initialisers() {
  std::string text;
  for (const NamedInitialiser& entry : initialisers()) text += entry.name + " (" + entry.description + "), ";
  return text + "FILE.json (a saved model)";
}

Initialiser initialiser_by_name(const std::string& name, int starts) {
  std::string known;
  for (const NamedInitialiser& entry : initialisers()) {
    if (entry.name == name) return entry.make(starts);
    known += entry.name + ", ";
  }
  fail("--init: there is no initialiser '", name, "'; expected ", known, "or a model file *.json");
}

bool is_model_file(const std::string& init) {
  constexpr std::string_view kEnding = ".json";
  return init.size() > kEnding.size() && init.ends_with(kEnding);
}

}  // namespace blockid::cli
