// All problems by name.
#pragma once

#include <blockid/problems/problem.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace blockid::problems {

/// A problem that is made or read when it is asked for.
struct CatalogueEntry {
  std::string name;
  std::string description;
  /// Throws Error naming the file when a measured record is missing.
  std::function<Problem()> load;
  /// Whether it comes from a file of the data folder.
  bool measured = false;
};

/// Measured problems first, then synthetic ones. Reads nothing; `folder` is where measured records are, by default
/// data_folder() at the time of loading.
std::vector<CatalogueEntry> catalogue(const std::filesystem::path& folder = {});

/// The entry of that name; throws Error that lists the names.
CatalogueEntry catalogue_entry(const std::string& name, const std::filesystem::path& folder = {});

}  // namespace blockid::problems
