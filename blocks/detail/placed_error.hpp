// A mistake at a place of a text.
#pragma once

#include <blockid/data/error.hpp>

#include <cstddef>
#include <string>

namespace blockid::detail {

/// An Error that knows the byte of the text it is about; parse() adds line, column and the text itself.
class PlacedError : public Error {
 public:
  PlacedError(std::size_t position, const std::string& message) : Error(message), position_(position) {}

  std::size_t position() const { return position_; }

 private:
  std::size_t position_;
};

/// Throws PlacedError with the message compose(parts...).
template <class... Parts>
[[noreturn]] void fail_at(std::size_t position, const Parts&... parts) {
  throw PlacedError(position, compose(parts...));
}

}  // namespace blockid::detail
