// Names of initialisers on the command line.
#pragma once

#include <blockid/estimators/candidate.hpp>

#include <functional>
#include <string>
#include <vector>

namespace blockid::cli {

/// An initialiser that `--init` knows by name.
struct NamedInitialiser {
  std::string name;
  std::string description;
  /// `starts`: how many starts of its own kind it tries; 0 for its default.
  std::function<Initialiser(int starts)> make;
};

/// All of them, in the order of the help text. A new initialiser is one more entry.
std::vector<NamedInitialiser> initialisers();

/// "split (...), none (...), FILE.json (...)" for help texts.
std::string describe_initialisers();

/// starts: see NamedInitialiser. Throws Error that lists the names.
Initialiser initialiser_by_name(const std::string& name, int starts = 0);

/// Whether `--init` names a model file: *.json.
bool is_model_file(const std::string& init);

}  // namespace blockid::cli
