// Names of the text form: labels, kinds, keys.
#pragma once

#include <string_view>

namespace blockid::detail {

constexpr bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
constexpr bool continues_name(char c) { return starts_name(c) || (c >= '0' && c <= '9'); }

/// True for [A-Za-z_][A-Za-z0-9_]*.
constexpr bool is_name(std::string_view text) {
  if (text.empty() || !starts_name(text.front())) return false;
  for (const char c : text) {
    if (!continues_name(c)) return false;
  }
  return true;
}

}  // namespace blockid::detail
