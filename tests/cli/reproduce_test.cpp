// The figures of publications, computed anew.
#include "cli/program.hpp"
#include "support/temp_dir.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace {

using blockid::testing::json_file;
using blockid::testing::ProgramRun;
using blockid::testing::run_program;
using blockid::testing::TempDir;
using nlohmann::json;
using ::testing::HasSubstr;

TEST(Reproduce, GiordanoSjoberg2015) {
  const TempDir folder;
  const ProgramRun run = run_program({"reproduce", "giordano2015", "--json", "r.json"}, folder.path());
  const json result = json_file(folder / "r.json");
  EXPECT_EQ(result["name"], "giordano2015");
  bool all = true;
  int refits = 0;
  for (const json& row : result["rows"]) {
    EXPECT_EQ(row.size(), 5U);
    EXPECT_TRUE(row["published"].is_number() || row["published"].is_null());
    EXPECT_FALSE(row["tolerance"].get<std::string>().empty());
    const auto quantity = row["quantity"].get<std::string>();
    EXPECT_TRUE(row["reproduced"].is_number()) << quantity;
    all = all && row["pass"].get<bool>();
    if (quantity == "true product: refitted / noise") {
      EXPECT_NEAR(row["reproduced"].get<double>(), 1.0, 0.05);
      ++refits;
    }
  }
  EXPECT_EQ(refits, 1);
  EXPECT_GE(result["rows"].size(), 18U);
  EXPECT_EQ(result["pass"].get<bool>(), all);
  EXPECT_EQ(run.code, all ? 0 : 2) << run.err;
  EXPECT_THAT(run.out, HasSubstr("published"));
}

TEST(Reproduce, ListsAndRefusesUnknownNames) {
  const TempDir folder;
  const ProgramRun list = run_program({"reproduce", "--list"}, folder.path());
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_THAT(list.out, HasSubstr("giordano2015"));
  const ProgramRun unknown = run_program({"reproduce", "nobody1900"}, folder.path());
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("expected giordano2015"));
  EXPECT_EQ(run_program({"reproduce"}, folder.path()).code, 1);
}

}  // namespace
