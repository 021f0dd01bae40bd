#include "blockid/data/mat_name.hpp"

#include <algorithm>
#include <charconv>

#include "blockid/data/error.hpp"

namespace blockid::mat {
namespace {

NamePart parse_part(std::string_view part, std::string_view text, std::string_view where) {
  const std::size_t bracket = part.find('[');
  NamePart result{std::string(part.substr(0, bracket)), std::nullopt};
  bool well_formed = !result.name.empty() && result.name.find(']') == std::string::npos;
  if (well_formed && bracket != std::string_view::npos) {
    std::size_t index = 0;
    const char* const end = part.data() + part.size();
    const auto number = std::from_chars(part.data() + bracket + 1, end, index);
    well_formed = number.ec == std::errc() && end - number.ptr == 1 && *number.ptr == ']';
    result.index = index;
  }
  if (!well_formed) fail(where, ": '", text, "' is no variable name: expected name, struct.field or name[k]");
  return result;
}

}  // namespace

std::vector<NamePart> parse_name(std::string_view text, std::string_view where) {
  std::vector<NamePart> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t dot = std::min(text.find('.', begin), text.size());
    parts.push_back(parse_part(text.substr(begin, dot - begin), text, where));
    begin = dot + 1;
  }
  return parts;
}

}  // namespace blockid::mat
