// What a conformance check found: laws kept, laws violated with place and numbers, laws that do not apply.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace blockid::testing {

/// One broken law. `expected`, `got` and `tolerance` are empty texts where a law is not about numbers.
struct LawViolation {
  std::string law;
  std::string where;
  std::string expected;
  std::string got;
  std::string tolerance;

  /// "law 'causal': y[3] after a change of u[4]: expected 1.5, got 1.25 (tolerance 1e-11)".
  std::string message() const {
    std::string text = "law '" + law + "': " + where;
    if (!expected.empty()) text += ": expected " + expected + ", got " + got;
    if (!tolerance.empty()) text += " (tolerance " + tolerance + ")";
    return text;
  }
};

/// Outcome of check_block().
struct ConformanceReport {
  /// Laws that were tested, violated or not, in the order of the tests.
  std::vector<std::string> checked;
  /// "law: reason" for each law that could not be tested.
  std::vector<std::string> skipped;
  /// At most kMostPerLaw for each law, the first ones.
  std::vector<LawViolation> violations;

  static constexpr std::ptrdiff_t kMostPerLaw = 4;

  bool ok() const { return violations.empty(); }

  bool violates(std::string_view law) const {
    return std::any_of(violations.begin(), violations.end(),
                       [&](const LawViolation& violation) { return violation.law == law; });
  }

  /// All violations, one a line; "conforms" when there is none.
  std::string text() const {
    if (ok()) return "conforms";
    std::string all;
    for (const LawViolation& violation : violations) all += violation.message() + "\n";
    return all;
  }

  void add(LawViolation violation) {
    const auto same = std::count_if(violations.begin(), violations.end(),
                                    [&](const LawViolation& v) { return v.law == violation.law; });
    if (same < kMostPerLaw) violations.push_back(std::move(violation));
  }
};

/// Writes what one law finds into a report.
class LawRecorder {
 public:
  LawRecorder(std::string law, ConformanceReport& report) : law_(std::move(law)), report_(report) {}

  /// A violation that is a matter of yes or no.
  void violated(const std::string& where) { report_.add({law_, where, "", "", ""}); }

  /// A violation by a number or a word.
  template <class Expected, class Got>
  void violated(const std::string& where, const Expected& expected, const Got& got, double tolerance = 0.0) {
    report_.add({law_, where, text_of(expected), text_of(got), tolerance > 0.0 ? text_of(tolerance) : ""});
  }

  template <class Expected, class Got>
  void equal(const std::string& where, const Expected& expected, const Got& got) {
    if (!(expected == got)) violated(where, expected, got);
  }

  void skip(const std::string& reason) { report_.skipped.push_back(law_ + ": " + reason); }

  /// |expected - got| <= tolerance * scale for every entry, where scale(c) belongs to column c. Reports the worst
  /// entry; `place(t, c)` puts it into words. NaN never passes.
  void close(const Eigen::Ref<const Eigen::MatrixXd>& expected, const Eigen::Ref<const Eigen::MatrixXd>& got,
             const Eigen::VectorXd& scale, double tolerance,
             const std::function<std::string(Eigen::Index, Eigen::Index)>& place) {
    double worst = 1.0;
    Eigen::Index worst_row = -1;
    Eigen::Index worst_column = -1;
    for (Eigen::Index c = 0; c < expected.cols(); ++c) {
      for (Eigen::Index t = 0; t < expected.rows(); ++t) {
        const double error = std::abs(expected(t, c) - got(t, c)) / (tolerance * scale[c]);
        if (error <= worst) continue;
        worst = std::isnan(error) ? HUGE_VAL : error;
        worst_row = t;
        worst_column = c;
        if (std::isnan(error)) break;
      }
    }
    if (worst_row < 0) return;
    violated(place(worst_row, worst_column), expected(worst_row, worst_column), got(worst_row, worst_column),
             tolerance * scale[worst_column]);
  }

 private:
  template <class T>
  static std::string text_of(const T& value) {
    std::ostringstream text;
    text.precision(12);
    text << value;
    return text.str();
  }

  std::string law_;
  ConformanceReport& report_;
};

}  // namespace blockid::testing
