#pragma once

// Internal to mat.cpp: the names by which parts of a MAT file are asked for.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace blockid::mat {

/// One step of "a.b[2].c": a name and, in brackets, a zero-based number.
struct NamePart {
  std::string name;
  std::optional<std::size_t> index;
};

/// Cuts a name at its dots.
/// @throws Error "where: 'text': ..." when it is malformed.
[[nodiscard]] std::vector<NamePart> parse_name(std::string_view text, std::string_view where);

}  // namespace blockid::mat
