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
  std::function<Initialiser()> make;
};

/// All of them, in the order of the help text. A new initialiser is one more entry.
std::vector<NamedInitialiser> initialisers();

/// "split (...), none (...), FILE.json (...)" for help texts.
std::string describe_initialisers();

/// Throws Error that lists the names.
Initialiser initialiser_by_name(const std::string& name);

/// Whether `--init` names a model file: *.json.
bool is_model_file(const std::string& init);

}  // namespace blockid::cli
