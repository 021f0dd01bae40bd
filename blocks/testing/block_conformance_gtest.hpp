// The laws of the Block contract in one line of a GoogleTest:
//
//   EXPECT_THAT(MyBlock{}, blockid::testing::ConformsToBlockLaws());
#pragma once

#include <blockid/testing/block_conformance.hpp>

#include <gmock/gmock.h>

#include <ostream>
#include <utility>

namespace blockid {

/// How GoogleTest shows a block in its messages.
inline void PrintTo(const AnyBlock& block, std::ostream* text) {  // NOLINT(readability-identifier-naming)
  *text << "a block of kind " << block.kind() << " with " << block.parameter_count() << " parameters and "
        << block.state_count() << " states";
}

}  // namespace blockid

namespace blockid::testing {

/// Matches any block that keeps all laws; explains with the violated ones.
class ConformsToBlockLaws {
 public:
  using is_gtest_matcher = void;  // NOLINT(readability-identifier-naming)

  explicit ConformsToBlockLaws(ConformanceOptions options = {}) : options_(std::move(options)) {}

  template <Block B>
  bool MatchAndExplain(const B& block, std::ostream* explanation) const {  // NOLINT(readability-identifier-naming)
    const ConformanceReport report = check_block(AnyBlock(block), options_);
    if (explanation != nullptr && !report.ok()) *explanation << "which breaks\n" << report.text();
    return report.ok();
  }
  // NOLINTNEXTLINE(readability-identifier-naming)
  bool MatchAndExplain(const AnyBlock& block, std::ostream* explanation) const {
    const ConformanceReport report = check_block(block, options_);
    if (explanation != nullptr && !report.ok()) *explanation << "which breaks\n" << report.text();
    return report.ok();
  }
  void DescribeTo(std::ostream* text) const { *text << "keeps the laws of the Block contract"; }        // NOLINT
  void DescribeNegationTo(std::ostream* text) const { *text << "breaks a law of the Block contract"; }  // NOLINT

 private:
  ConformanceOptions options_;
};

}  // namespace blockid::testing
