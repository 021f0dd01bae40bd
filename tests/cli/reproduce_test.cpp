// The figures of publications, computed anew.
#include "cli/program.hpp"
#include "support/data_dir.hpp"
#include "support/temp_dir.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/data/atomic_file.hpp>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

using blockid::testing::json_file;
using blockid::testing::ProgramRun;
using blockid::testing::run_program;
using blockid::testing::TempDir;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Every element that opens closes, in the right order, and no attribute lacks its quotes.
void expect_well_formed(const std::string& xml) {
  static const std::regex kTag(
      R"re(<(/?)([A-Za-z][A-Za-z0-9:]*)((?:\s+[A-Za-z][A-Za-z0-9:_-]*\s*=\s*(?:"[^"<]*"|'[^'<]*'))*)\s*(/?)>)re");
  const std::size_t prologue = xml.find("?>");
  ASSERT_NE(prologue, std::string::npos);
  const std::string body = xml.substr(prologue + 2);
  std::vector<std::string> open;
  std::ptrdiff_t tags = 0;
  for (std::sregex_iterator it(body.begin(), body.end(), kTag), end; it != end; ++it, ++tags) {
    const std::string name = (*it)[2];
    if ((*it)[1].length() > 0) {
      ASSERT_FALSE(open.empty()) << "</" << name << ">";
      EXPECT_EQ(open.back(), name);
      open.pop_back();
    } else if ((*it)[4].length() == 0) {
      open.push_back(name);
    }
  }
  EXPECT_THAT(open, IsEmpty());
  EXPECT_EQ(tags, std::count(body.begin(), body.end(), '<')) << "a '<' that begins no element";
}

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
  ASSERT_GE(result["notes"].size(), 1U);
  EXPECT_THAT(run.out, HasSubstr(result["notes"].front().get<std::string>()));
  EXPECT_TRUE(result["pictures"].empty());
}

TEST(Reproduce, WritesPicturesThatStandAlone) {
  const TempDir folder;
  const ProgramRun run =
      run_program({"reproduce", "giordano2015", "-o", "pictures", "--json", "r.json", "--quiet"}, folder.path());
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.out, "");
  const json pictures = json_file(folder / "r.json")["pictures"];
  if (!blockid::cli::gnuplot_is_there()) {
    EXPECT_THAT(run.err, HasSubstr("no pictures"));
    EXPECT_TRUE(pictures.empty());
    return;
  }
  std::vector<std::string> stems;
  for (const json& file : pictures) {
    const fs::path path = folder.path() / file.get<std::string>();
    stems.push_back(path.stem().string());
    const std::string text = blockid::read_file(path);
    EXPECT_EQ(text.rfind("<?xml version=\"1.0\"", 0), 0U) << path;
    EXPECT_THAT(text, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
    expect_well_formed(text);
  }
  EXPECT_THAT(stems, ElementsAre("figure_2", "figure_3", "figure_4", "figure_5", "bla", "errors"));
}

TEST(Reproduce, DoesWithoutGnuplot) {
  const TempDir folder;
  const ProgramRun run = run_program({"reproduce", "giordano2015", "-o", "pictures"}, folder.path(), {"PATH=/nowhere"});
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("gnuplot is not installed"));
  EXPECT_TRUE(fs::is_empty(folder / "pictures"));
}

TEST(Reproduce, HelpNamesTheExitCodeOfAMissedFigure) {
  const TempDir folder;
  EXPECT_THAT(run_program({"reproduce", "--help"}, folder.path()).out,
              HasSubstr("Exit code 2 means that a published figure was missed"));
}

TEST(Reproduce, RefusesAFolderThatCannotBe) {
  const TempDir folder;
  const ProgramRun run = run_program({"reproduce", "giordano2015", "-o", "/dev/null/pictures"}, folder.path());
  EXPECT_EQ(run.code, 3);
  EXPECT_THAT(run.err, HasSubstr("cannot make the folder"));
}

TEST(Reproduce, Janiszowski1999) {
  const TempDir folder;
  for (const char* table : {"janiszowski1999-table1", "janiszowski1999-table2"}) {
    const ProgramRun run = run_program({"reproduce", table, "--json", "r.json"}, folder.path());
    EXPECT_EQ(run.code, 0) << run.out << run.err;
    const json result = json_file(folder / "r.json");
    EXPECT_TRUE(result["pass"].get<bool>());
    EXPECT_GE(result["rows"].size(), 25U);
    EXPECT_GE(result["notes"].size(), 3U);
  }
}

TEST(Reproduce, WelshAndGoodwin2003) {
  const TempDir folder;
  const ProgramRun run = run_program({"reproduce", "welsh2003", "-o", "pictures", "--json", "r.json"}, folder.path());
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json result = json_file(folder / "r.json");
  // Five lines of table 1 with three figures each, and ours.
  int published = 0;
  for (const json& row : result["rows"]) published += row["published"].is_number() ? 1 : 0;
  EXPECT_EQ(published, 15);
  EXPECT_GE(result["notes"].size(), 8U);
  if (!blockid::cli::gnuplot_is_there()) return;
  ASSERT_EQ(result["pictures"].size(), 2U);
  for (const json& file : result["pictures"]) {
    expect_well_formed(blockid::read_file(folder.path() / file.get<std::string>()));
  }
}

TEST(Reproduce, WelshAndGoodwin2003Theorem1) {
  const TempDir folder;
  const ProgramRun run =
      run_program({"reproduce", "welsh2003-theorem1", "-o", "pictures", "--json", "r.json"}, folder.path());
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json result = json_file(folder / "r.json");
  EXPECT_GE(result["rows"].size(), 15U);
  EXPECT_GE(result["notes"].size(), 5U);
  EXPECT_EQ(result["pictures"].size(), blockid::cli::gnuplot_is_there() ? 2U : 0U);
}

TEST(Reproduce, GarnierGoodwinWelsh2004) {
  const TempDir folder;
  const ProgramRun run = run_program({"reproduce", "garnier2004", "--json", "r.json"}, folder.path());
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json result = json_file(folder / "r.json");
  EXPECT_TRUE(result["pass"].get<bool>());
  EXPECT_EQ(result["rows"].size(), 12U);
  EXPECT_EQ(result["notes"].size(), 5U);
  EXPECT_DOUBLE_EQ(result["rows"][0]["published"].get<double>(), 1.4e14);
  EXPECT_DOUBLE_EQ(result["rows"][1]["published"].get<double>(), 4120.0);
}

TEST(Reproduce, RobotArm) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "robot_arm/contsid_robotarm.mat");
  const TempDir folder;
  const std::string data = "BLOCKID_DATA_DIR=" + blockid::testing::data_dir().string();
  const ProgramRun run = run_program({"reproduce", "garnier2004-robot-arm", "--json", "r.json"}, folder.path(), {data});
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json result = json_file(folder / "r.json");
  EXPECT_TRUE(result["pass"].get<bool>());
  const json& last = result["rows"].back();
  EXPECT_GE(last["reproduced"].get<double>(), 0.96);
}

TEST(Reproduce, RobotArmNamesTheMissingRecord) {
  const TempDir folder;
  const ProgramRun run = run_program({"reproduce", "garnier2004-robot-arm"}, folder.path(),
                                     {"BLOCKID_DATA_DIR=" + folder.path().string()});
  EXPECT_NE(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("robot_arm/contsid_robotarm.mat"));
}

TEST(Reproduce, CrowderAndCallafon) {
  const TempDir folder;
  const ProgramRun run =
      run_program({"reproduce", "crowder-callafon", "-o", "pictures", "--json", "r.json"}, folder.path());
  EXPECT_EQ(run.code, 0) << run.out << run.err;
  const json result = json_file(folder / "r.json");
  EXPECT_TRUE(result["pass"].get<bool>());
  EXPECT_EQ(result["rows"].size(), 31U);
  EXPECT_GE(result["notes"].size(), 13U);
  if (blockid::cli::gnuplot_is_there()) {
    for (const char* stem : {"figure2.svg", "figure3.svg"})
      expect_well_formed(blockid::read_file(folder / "pictures" / stem));
  }
}

TEST(Reproduce, ListsAndRefusesUnknownNames) {
  const TempDir folder;
  const ProgramRun list = run_program({"reproduce", "--list"}, folder.path());
  EXPECT_EQ(list.code, 0) << list.err;
  EXPECT_THAT(list.out, HasSubstr("giordano2015"));
  const ProgramRun unknown = run_program({"reproduce", "nobody1900"}, folder.path());
  EXPECT_EQ(unknown.code, 1);
  EXPECT_THAT(unknown.err, HasSubstr("expected garnier2004, garnier2004-robot-arm, giordano2015"));
  EXPECT_EQ(run_program({"reproduce"}, folder.path()).code, 1);
}

}  // namespace
