#include <blockid/cli/initialisers.hpp>

#include <blockid/data/error.hpp>
#include <blockid/init/classify.hpp>
#include <blockid/init/combined.hpp>
#include <blockid/init/random_starts.hpp>
#include <blockid/init/release.hpp>
#include <blockid/init/split.hpp>

#include <string_view>

namespace blockid::cli {

std::vector<NamedInitialiser> initialisers() {
  return {
      {"fractional", "exponents of the best linear approximation's roots: release and classify",
       [] { return fractional(); }},
      {"release", "expansions of both filters set free, then reduced", [] { return release(); }},
      {"classify", "fractional exponents rounded", [] { return classify(); }},
      {"random", "random stable filters", [] { return random_starts(); }},
      {"split", "all ways to split the best linear approximation between the filters",
       [] { return exhaustive_split(); }},
      {"none", "the blocks' own initial parameters", [] { return no_initialiser(); }},
  };
}

std::string describe_initialisers() {
  std::string text;
  for (const NamedInitialiser& entry : initialisers()) text += entry.name + " (" + entry.description + "), ";
  return text + "FILE.json (a saved model)";
}

Initialiser initialiser_by_name(const std::string& name) {
  std::string known;
  for (const NamedInitialiser& entry : initialisers()) {
    if (entry.name == name) return entry.make();
    known += entry.name + ", ";
  }
  fail("--init: there is no initialiser '", name, "'; expected ", known, "or a model file *.json");
}

bool is_model_file(const std::string& init) {
  constexpr std::string_view kEnding = ".json";
  return init.size() > kEnding.size() && init.ends_with(kEnding);
}

}  // namespace blockid::cli
