#include <blockid/blocks/detail/format.hpp>

#include <array>
#include <charconv>

namespace blockid::detail {

std::string number_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string list_text(const std::vector<double>& values) {
  std::string text = "[";
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (k > 0) text += ',';
    text += number_text(values[k]);
  }
  return text + "]";
}

}  // namespace blockid::detail
