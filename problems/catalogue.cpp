#include <blockid/problems/catalogue.hpp>

#include <blockid/data/error.hpp>
#include <blockid/problems/giordano_sjoberg.hpp>
#include <blockid/problems/measured.hpp>
#include <blockid/problems/random_wh.hpp>
#include <blockid/problems/synthetic_wh.hpp>

#include <utility>

namespace blockid::problems {
namespace {

CatalogueEntry random_entry(StaticKind kind) {
  RandomWienerHammersteinOptions options;
  options.static_kind = kind;
  return {"random_wh_" + to_text(kind), "random filters of order 3 around a " + to_text(kind) + ", 40 dB",
          [options] { return random_wiener_hammerstein(options); }};
}

}  // namespace

std::vector<CatalogueEntry> catalogue(const std::filesystem::path& folder) {
  const auto measured = [&folder](std::string name, std::string description,
                                  Problem (*load)(const std::filesystem::path&)) {
    return CatalogueEntry{std::move(name), std::move(description),
                          [folder, load] { return load(folder.empty() ? data_folder() : folder); }, true};
  };
  std::vector<CatalogueEntry> entries = {
      measured("wh2009", "SYSID'09 Wiener-Hammerstein circuit", wiener_hammerstein_2009),
      measured("wh_process_noise", "Wiener-Hammerstein circuit with process noise", wiener_hammerstein_process_noise),
      measured("heat_exchanger", "heat exchanger, flow to temperature", heat_exchanger),
      measured("cascaded_tanks", "two tanks with overflow", cascaded_tanks),
      measured("silverbox", "Duffing-like circuit, tested on the arrow", silverbox),
      measured("robot_arm", "flexible robot arm, torque to acceleration", robot_arm),
      {"synthetic_wiener_hammerstein", "third-order filters around a saturating polynomial",
       [] { return synthetic_wiener_hammerstein(); }},
      {"giordano_sjoberg_2015", "simulation example of Giordano and Sjoberg 2015", [] { return giordano_sjoberg(); }},
  };
  for (const StaticKind kind : static_kinds()) entries.push_back(random_entry(kind));
  entries.push_back(
      {"short_wh_0", "first of the short noise-free systems", [] { return short_wiener_hammerstein(0); }});
  return entries;
}

CatalogueEntry catalogue_entry(const std::string& name, const std::filesystem::path& folder) {
  std::string known;
  for (CatalogueEntry& entry : catalogue(folder)) {
    if (entry.name == name) return std::move(entry);
    known += (known.empty() ? "" : ", ") + entry.name;
  }
  fail("there is no problem '", name, "'; expected ", known);
}

}  // namespace blockid::problems
