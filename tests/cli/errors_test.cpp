// Every mistake gets its exit code and a message that says what to do.
#include "cli/program.hpp"
#include "support/temp_dir.hpp"

#include <blockid/data/atomic_file.hpp>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

using blockid::testing::kSyntheticChain;
using blockid::testing::ProgramRun;
using blockid::testing::run_program;
using blockid::testing::TempDir;
using blockid::testing::write_synthetic_csv;
using ::testing::HasSubstr;
using ::testing::Not;

using Arguments = std::vector<std::string>;

class ProgramErrors : public ::testing::Test {
 protected:
  void SetUp() override { write_synthetic_csv(folder_ / "data.csv", 500); }

  /// A fit whose options can be replaced or, with an empty value, left out.
  ProgramRun fit(const std::map<std::string, std::string>& changes, const Arguments& more = {}) const {
    std::map<std::string, std::string> options = {
        {"DATA", "data.csv"}, {"--input", "u"}, {"--output", "y"}, {"--rate", "1000"}, {"--model", kSyntheticChain}};
    for (const auto& [name, value] : changes) options[name] = value;
    Arguments arguments = {"fit", options["DATA"]};
    options.erase("DATA");
    for (const auto& [name, value] : options) {
      if (!value.empty()) arguments.insert(arguments.end(), {name, value});
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, folder_.path());
  }

  void write(const std::string& name, const std::string& text) const {
    blockid::write_file_atomically(folder_ / name, text);
  }

  TempDir folder_;
};

/// Exit code and parts of the message.
void expect(const ProgramRun& run, int code, const std::vector<std::string>& parts) {
  EXPECT_EQ(run.code, code) << run.err;
  EXPECT_EQ(run.out, "");
  for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part));
}

TEST_F(ProgramErrors, NoOrUnknownCommandAndOptions) {
  expect(run_program({}, folder_.path()), 1, {"subcommand"});
  expect(run_program({"identify"}, folder_.path()), 1, {"identify", "fit", "simulate", "bla", "info", "demo"});
  expect(fit({}, {"--wrong"}), 1, {"--wrong"});
  expect(fit({{"--output", ""}}), 1, {"--output", "required"});
  expect(fit({{"--initial-state", "moving"}}), 1, {"moving", "zero", "estimated", "periodic"});
  expect(fit({{"--warmup", "-3"}}), 1, {"--warmup"});
}

TEST_F(ProgramErrors, Files) {
  expect(fit({{"DATA", "nothing.csv"}}), 1, {"nothing.csv", "no such file"});
  write("ragged.csv", "u,y\n1,2\n3\n4,5\n");
  expect(fit({{"DATA", "ragged.csv"}}), 1, {"ragged.csv:3"});
  write("text.csv", "u,y\n1,2\n3,four\n");
  expect(fit({{"DATA", "text.csv"}}), 1, {"text.csv:3", "column 2"});
  expect(run_program({"info", "nothing.mat"}, folder_.path()), 1, {"nothing.mat"});
}

TEST_F(ProgramErrors, UnknownColumnsAreListed) {
  expect(fit({{"--input", "voltage"}}), 1, {"voltage", "u", "y", "data.csv"});
  expect(fit({{"--output", "7"}}), 1, {"7", "u", "y"});
}

TEST_F(ProgramErrors, SampleTimeExactlyOnce) {
  const std::string hint = "exactly one of --rate HZ, --sample-time S, --rate-from NAME, --sample-time-from NAME";
  expect(fit({{"--sample-time", "0.001"}}), 1, {"2 ways", hint});
  expect(fit({{"--rate", ""}}), 1, {"0 ways", hint});
  expect(fit({{"--rate", "0"}}), 1, {"sampling rate is 0"});
  expect(fit({{"--rate", "fast"}}), 1, {"--rate"});
  expect(fit({{"--rate", ""}, {"--rate-from", "u"}}), 1, {"varies"});
}

/// u and y of data.csv behind time stamps of a millisecond, in milliseconds rounded to whole ones; `lost` samples are
/// left out after the hundredth.
std::string with_stamps(const std::string& csv, int lost) {
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  std::string text = "t," + line + "\n";
  for (int k = 0; std::getline(lines, line); ++k) {
    if (k >= 100 && k < 100 + lost) continue;
    text += std::to_string(k) + "e-3," + line + "\n";
  }
  return text;
}

TEST_F(ProgramErrors, TimeStamps) {
  const std::string csv = blockid::read_file(folder_ / "data.csv");
  write("even.csv", with_stamps(csv, 0));
  write("lost.csv", with_stamps(csv, 1));
  write("model.json",
        R"json({"format": "blockid-model", "version": 1, "chain": "G=rational(nb=0,na=1)", "sample_time_s": 0.001,
            "parameters": [{"name": "G.b0", "value": 1}, {"name": "G.a1", "value": -0.5}]})json");
  const std::vector<Arguments> commands = {
      {"fit", "DATA", "--model", "G=rational(nb=0,na=1)", "--init", "none", "--max-iterations", "2"},
      {"bla", "DATA", "--orders", "1,1"},
      {"ct", "DATA", "--orders", "0,1"},
      {"ct", "DATA", "--orders", "0,1", "--method", "tustin"},
      {"frf", "DATA", "--orders", "0,1"},
      {"linear", "DATA", "--structure", "arx", "--orders", "na=1,nb=1"},
      {"simulate", "model.json", "DATA"},
      {"validate", "model.json", "DATA"},
      {"closed-loop", "DATA", "--plant", "0,0.1 / 1,-0.9", "--controller", "1", "--weight", "0.1", "--range", "0:50"}};
  const auto run = [&](Arguments command, const std::string& file, const Arguments& more) {
    for (std::string& word : command) word = word == "DATA" ? file : word;
    command.insert(command.end(), {"--input", "u", "--output", "y"});
    command.insert(command.end(), more.begin(), more.end());
    return run_program(command, folder_.path());
  };
  for (const Arguments& command : commands) {
    SCOPED_TRACE(command[0]);
    EXPECT_NE(run(command, "even.csv", {"--time", "t"}).code, 1);
    expect(run(command, "lost.csv", {"--time", "t"}), 1,
           {"lost.csv", "'t' are not uniform", "sample index 100 comes 0.002 s", "expected 0.001 s"});
    const ProgramRun warned = run(command, "lost.csv", {"--rate", "1000"});
    EXPECT_NE(warned.code, 1);
    EXPECT_THAT(warned.err + warned.out, HasSubstr("the column is not used, but time stamps 't' are not uniform"));
    EXPECT_THAT(run(command, "even.csv", {"--rate", "1000"}).err, Not(HasSubstr("'t'")));
    expect(run(command, "even.csv", {"--time", "t", "--rate", "990"}), 1, {"'t' are 0.001 s apart"});
  }
}

TEST_F(ProgramErrors, Ranges) {
  expect(fit({{"--train", "zero:100"}}), 1, {"--train zero:100"});
  expect(fit({{"--train", "300:100"}}), 1, {"--train 300:100"});
  expect(fit({{"--test", "400:900"}}), 1, {"--test 400:900", "500"});
  expect(fit({{"--warmup", "500"}}), 1, {"warm-up"});
}

TEST_F(ProgramErrors, ModelTextWithItsColumn) {
  expect(fit({{"--model", "G=rational(nb=1,na=1) | f=splin(knots=5)"}}), 1,
         {"--model", "column 27", "splin", "spline"});
  expect(fit({{"--model", "G=rational(nb=1,order=1)"}}), 1, {"order", "nb", "na", "nk"});
  expect(fit({{"--model", ""}}), 1, {"--model is required"});
}

TEST_F(ProgramErrors, InitialiserAndFrozenNames) {
  expect(fit({{"--init", "guess"}}), 1, {"guess", "split", "none"});
  expect(fit({{"--init", "absent.json"}, {"--model", ""}}), 1, {"absent.json"});
  expect(fit({{"--init", "absent.json"}}), 1, {"leave --model out"});
  expect(fit({{"--freeze", "G3.b0"}}), 1, {"--freeze", "G3.b0", "G1.b0"});
  expect(fit({{"--model", "[rational(nb=1,na=1) + rational(nb=1,na=1)]"}}), 1, {"fractional"});
}

TEST_F(ProgramErrors, Data) {
  expect(fit({{"--train", "0:15"}}), 1, {"fewer samples than parameters", "15", "20"});
  std::string constant = "u,y\n";
  for (int t = 0; t < 100; ++t) constant += "2.5," + std::to_string(t % 7) + "\n";
  write("constant.csv", constant);
  expect(fit({{"DATA", "constant.csv"}}), 1, {"constant", "2.5"});
  write("nan.csv", "u,y\n1,2\n2,nan\n3,4\n");
  expect(fit({{"DATA", "nan.csv"}}), 1, {"nan.csv:3", "column 2"});
  expect(fit({{"--initial-state", "periodic"}}), 1, {"--period"});
  expect(fit({{"--period", "1000"}}), 1, {"period"});
}

TEST_F(ProgramErrors, OutputsAreCheckedBeforeTheWork) {
  expect(fit({{"-o", "missing/model.json"}}), 3, {"missing/model.json", "no folder"});
  expect(fit({{"--json", folder_.path().string()}}), 3, {"is a folder"});
  expect(fit({{"-o", "same.json"}, {"--json", "./same.json"}}), 1, {"same file"});
  if (::geteuid() == 0) return;  // root may write everywhere
  std::filesystem::create_directory(folder_ / "closed");
  std::filesystem::permissions(folder_ / "closed", std::filesystem::perms::owner_read);
  expect(fit({{"--report", "closed/report.html"}}), 3, {"closed/report.html"});
}

TEST_F(ProgramErrors, Simulate) {
  write("broken.json", "{\"format\": \"blockid-model\", \"version\": 1}");
  expect(run_program({"simulate", "broken.json", "data.csv", "--input", "u"}, folder_.path()), 1,
         {"broken.json", "chain"});
  write("model.json",
        R"json({"format": "blockid-model", "version": 1, "chain": "G=rational(nb=0,na=1)", "sample_time_s": 0.001,
            "parameters": [{"name": "G.b0", "value": 1}, {"name": "G.a1", "value": -0.5}]})json");
  const Arguments simulate = {"simulate", "model.json", "data.csv", "--input", "u"};
  const auto with = [&](const Arguments& more) {
    Arguments arguments = simulate;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, folder_.path());
  };
  EXPECT_EQ(with({}).code, 0);
  EXPECT_EQ(with({"--rate", "1000"}).code, 0);
  expect(with({"--rate", "2000"}), 1, {"0.0005 s", "0.001 s"});
  expect(with({"--range", "400:501"}), 1, {"--range 400:501"});
  expect(with({"--initial-state", "estimated"}), 1, {"--output"});
  expect(with({"--initial-state", "model"}), 1, {"no initial state"});
}

TEST_F(ProgramErrors, UnstableSimulationIsANumericalFailure) {
  write("unstable.json",
        R"json({"format": "blockid-model", "version": 1, "chain": "G=rational(nb=0,na=1)", "sample_time_s": 0.001,
            "parameters": [{"name": "G.b0", "value": 1}, {"name": "G.a1", "value": -9.0}]})json");
  const ProgramRun run = run_program({"simulate", "unstable.json", "data.csv", "--input", "u", "--output", "y",
                                      "--json", "result.json", "-o", "yhat.csv"},
                                     folder_.path());
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("not finite from sample"));
  const nlohmann::json result = blockid::testing::json_file(folder_ / "result.json");
  EXPECT_EQ(result["finite"], false);
  EXPECT_TRUE(result["metrics"]["rmse"].is_null());
}

TEST_F(ProgramErrors, Bla) {
  const Arguments bla = {"bla", "data.csv", "--input", "u", "--output", "y", "--rate", "1000"};
  const auto with = [&](const Arguments& more) {
    Arguments arguments = bla;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments, folder_.path());
  };
  expect(with({"--orders", "2"}), 1, {"--orders", "NB,NA"});
  expect(with({"--orders", "2,2", "--max-order", "3"}), 1, {"--orders", "--max-order"});
  expect(with({"--max-order", "0"}), 1, {"--max-order"});
}

}  // namespace
