#pragma once

#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

namespace blockid {

/// A caller's mistake: wrong sizes, unknown names, unreadable files, samples that are not numbers.
///
/// The message says where (block label, file and line, variable, record), what was expected and
/// what came. Numerical outcomes (no convergence, ill conditioning) are results and never thrown.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The parts written one after another with operator<<; floating-point parts carry ten significant
/// digits.
template <class... Parts>
[[nodiscard]] std::string compose(const Parts&... parts) {
  std::ostringstream text;
  text.imbue(std::locale::classic());  // a global locale may group digits
  text.precision(10);
  (text << ... << parts);
  return text.str();
}

/// Throws Error with the message compose(parts...).
template <class... Parts>
[[noreturn]] void fail(const Parts&... parts) {
  throw Error(compose(parts...));
}

}  // namespace blockid
