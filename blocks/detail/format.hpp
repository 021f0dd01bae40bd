// Numbers as text that reads back bit for bit.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace blockid::detail {

/// Shortest decimal that reads back as the same double.
std::string number_text(double value);

/// `[1,2.5,-3]`.
std::string list_text(const std::vector<double>& values);

}  // namespace blockid::detail
