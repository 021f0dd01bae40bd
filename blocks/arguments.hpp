// Structure of a block as the text form writes it: key=value pairs.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace blockid {

/// Structure of a block: keys in the order of the text form, values as text, e.g. {{"nb","3"},{"na","3"}}.
/// A value is a number, a word, a list `[1,2,3]` or a nested block; a nested positional block has the key "".
using Arguments = std::vector<std::pair<std::string, std::string>>;

}  // namespace blockid
