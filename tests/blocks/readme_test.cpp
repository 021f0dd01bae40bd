// The code of blocks/README.md, and a test that it stands there as it stands here.
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "support/source_dir.hpp"

// clang-format off
// x_{t+1} = a x_t + tanh(b u_t), y_t = x_{t+1}; theta = [a, b].
struct SaturatingLag {
  blockid::Index parameter_count() const { return 2; }
  blockid::Index state_count() const { return 1; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = x[0] = theta[0] * x[0] + tanh(theta[1] * u[t]);
  }
};
// clang-format on

namespace blockid {
namespace {

TEST(BlocksReadmeTest, TheTenLinesKeepTheLaws) {
  // clang-format off
const blockid::Series chain({{"G", blockid::Rational(2, 2)}, {"lag", SaturatingLag{}}});
EXPECT_THAT(SaturatingLag{}, blockid::testing::ConformsToBlockLaws());
  // clang-format on
  EXPECT_THAT(chain, testing::ConformsToBlockLaws());
}

std::string content(const std::filesystem::path& path) {
  std::ifstream file(testing::source_dir() / path);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(BlocksReadmeTest, CodeIsWhatIsCompiledHere) {
  const std::string readme = content("blocks/README.md");
  const std::string here = content("tests/blocks/readme_test.cpp");
  int blocks = 0;
  for (std::size_t start = readme.find("```cpp\n"); start != std::string::npos;
       start = readme.find("```cpp\n", start)) {
    start += 7;
    const std::string code = readme.substr(start, readme.find("```", start) - start);
    EXPECT_NE(here.find(code), std::string::npos) << code;
    ++blocks;
  }
  EXPECT_EQ(blocks, 2);
}

TEST(BlocksReadmeTest, TableOfLawsIsComplete) {
  const std::string readme = content("blocks/README.md");
  const std::string suite = content("blocks/testing/block_conformance.hpp");
  for (const testing::BlockLaw& law : testing::kBlockLaws) {
    EXPECT_THAT(readme, ::testing::HasSubstr(law.name)) << "a law of the suite";
  }
  for (std::size_t start = readme.find("`law_"); start != std::string::npos; start = readme.find("`law_", start + 1)) {
    const std::string function = readme.substr(start + 1, readme.find('`', start + 1) - start - 1);
    EXPECT_THAT(suite, ::testing::HasSubstr("inline void " + function + "(")) << "a law of the README";
  }
}

}  // namespace
}  // namespace blockid
