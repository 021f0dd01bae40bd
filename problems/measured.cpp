#include <blockid/problems/measured.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/load.hpp>
#include <blockid/data/mat.hpp>

#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace blockid::problems {
namespace {

namespace fs = std::filesystem;

constexpr Eigen::Index kMeasuredWarmup = 50;
constexpr double kMilli = 1e3;
/// Samples that the measured input runs ahead of the reference in the test records of the process noise benchmark.
constexpr Eigen::Index kUsualLead = 11;

/// folder / relative; throws Error unless it is a file.
fs::path existing(const fs::path& folder, const std::string& relative) {
  fs::path file = folder / relative;
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) {
    fail("measured record ", file.string(), " is not here; BLOCKID_DATA_DIR names the folder that holds ", relative);
  }
  return file;
}

/// The record with its output, measured in V, in mV.
Record in_millivolt(Record record) {
  record.y *= kMilli;
  record.output_unit = "mV";
  return record;
}

Record named(Record record, std::string name) {
  record.name = std::move(name);
  return record;
}

/// How many samples the periodic signal `acquired` runs ahead of `reference`: the largest circular correlation.
Eigen::Index lead(const Eigen::VectorXd& acquired, const Eigen::VectorXd& reference) {
  constexpr Eigen::Index kMost = 64;
  const Eigen::Index length = reference.size();
  Eigen::VectorXd correlation = Eigen::VectorXd::Zero(kMost);
  for (Eigen::Index k = 0; k < kMost; ++k) {
    correlation[k] =
        acquired.head(length - k).dot(reference.tail(length - k)) + acquired.tail(k).dot(reference.head(k));
  }
  Eigen::Index best = 0;
  correlation.maxCoeff(&best);
  return best;
}

/// The periodic signal `by` samples later.
Eigen::VectorXd rotated(const Eigen::VectorXd& signal, Eigen::Index by) {
  const Eigen::Index length = signal.size();
  const Eigen::Index shift = (by % length + length) % length;
  Eigen::VectorXd result(length);
  result << signal.tail(shift), signal.head(length - shift);
  return result;
}

std::vector<PublishedFigure> figures_of_the_tanks() {
  const std::string source = "table 2 of Mathematical Problems in Engineering 2021, 6613425, which calls it MSE";
  return {{"nonlinear state space", 0.343, "V", source},
          {"polynomial nonlinear state space", 0.450, "V", source},
          {"Volterra series of degree 3", 0.540, "V", source},
          {"best linear approximation", 0.757, "V", source}};
}

std::vector<PublishedFigure> figures_of_2009() {
  return {
      {"SUBNET encoder", 0.241, "mV", "Beintema, Toth, Schoukens 2021"},
      {"quadratic best linear approximation", 0.279, "mV", "Schoukens, Tiels, Ishteva 2014"},
      {"best split", 0.30, "mV", "Sjoberg, Lauwers, Schoukens 2012 (0.28 to 0.30)"},
      {"NL-LFR", 0.294, "mV", "Schoukens, Toth 2020"},
      {"PNLSS", 0.42, "mV", "Paduart 2012"},
      {"dynoNet", 0.452, "mV", "Forgione, Piga 2021"},
  };
}

}  // namespace

fs::path data_folder() {
  if (const char* given = std::getenv("BLOCKID_DATA_DIR"); given != nullptr && *given != '\0') return given;
  std::error_code ignored;
  const fs::path start = fs::current_path(ignored);
  for (fs::path here = start; !here.empty(); here = here.parent_path()) {
    fs::path candidate = here / "shared" / "data";
    if (fs::is_directory(candidate, ignored)) return candidate;
    if (here == here.parent_path()) break;
  }
  return fs::path("..") / "shared" / "data";
}

Problem wiener_hammerstein_2009(const fs::path& folder) {
  LoadSpec spec;
  spec.path = existing(folder, "wh2009/WienerHammerBenchMark.mat");
  spec.input = "uBenchMark";
  spec.output = "yBenchMark";
  spec.rate_from = "fs";
  const Record whole = in_millivolt(load_record(spec));
  return {.name = "wh2009",
          .description = "SYSID'09 Wiener-Hammerstein circuit: filter, diode and resistor, filter",
          .train = slice(whole, 5200, 105200),
          .test = slice(whole, 105200, 184000),
          .warmup = kMeasuredWarmup,
          .unit = "mV",
          .published = figures_of_2009()};
}

Problem wiener_hammerstein_process_noise(const fs::path& folder) {
  const auto load = [](const fs::path& path, const std::string& column, const std::string& name) {
    LoadSpec spec;
    spec.path = path;
    spec.input = "dataMeas.u" + column;
    spec.output = "dataMeas.y" + column;
    spec.rate_from = "dataMeas.fs";
    const Eigen::VectorXd acquired = load_record(spec).u;
    spec.input = "dataMeas.r" + column;
    Record record = named(in_millivolt(load_record(spec)), name);
    record.u = rotated(record.u, kUsualLead - lead(acquired, record.u));
    record.period = record.u.size();
    return record;
  };
  const fs::path estimation = existing(folder, "wh_process_noise/WH_EstimationExample.mat");
  const fs::path test = existing(folder, "wh_process_noise/WH_TestDataset.mat");
  std::vector<Record> train;
  const Eigen::Index realisations = MatFile(estimation).matrix("dataMeas.y").cols();
  for (Eigen::Index k = 0; k < realisations; ++k) {
    train.push_back(load(estimation, compose("[", k, "]"), compose("realisation ", k)));
  }
  return {.name = "wh_process_noise",
          .description = "Wiener-Hammerstein circuit with process noise before the nonlinearity; tested without",
          .train = std::move(train),
          .test = std::vector<Record>{load(test, "[0]", "multisine"), load(test, "[1]", "swept sine")},
          .warmup = kMeasuredWarmup,
          .unit = "mV"};
}

Problem heat_exchanger(const fs::path& folder) {
  LoadSpec spec;
  spec.path = existing(folder, "daisy/exchanger.dat");
  spec.input = "2";
  spec.output = "3";
  spec.sample_time_s = 1.0;
  Record whole = load_record(spec);
  whole.output_unit = "degC";
  return {.name = "heat_exchanger",
          .description = "liquid-saturated steam heat exchanger, flow to temperature",
          .train = slice(whole, 0, 3000),
          .test = slice(whole, 3000, 4000),
          .warmup = kMeasuredWarmup,
          .unit = "degC"};
}

Problem cascaded_tanks(const fs::path& folder) {
  const fs::path file = existing(folder, "cascaded_tanks/dataBenchmark.mat");
  const auto load = [&file](const std::string& suffix, const std::string& name) {
    LoadSpec spec;
    spec.path = file;
    spec.input = "u" + suffix;
    spec.output = "y" + suffix;
    spec.sample_time_from = "Ts";
    Record record = named(load_record(spec), name);
    record.output_unit = "V";
    return record;
  };
  return {.name = "cascaded_tanks",
          .description = "two tanks with overflow, pump voltage to level",
          .train = load("Est", "estimation"),
          .test = load("Val", "validation"),
          .warmup = kMeasuredWarmup,
          .unit = "V",
          .published = figures_of_the_tanks()};
}

Problem silverbox(const fs::path& folder) {
  LoadSpec spec;
  spec.path = existing(folder, "silverbox/SNLS80mV.mat");
  spec.input = "V1";
  spec.output = "V2";
  spec.rate_hz = 610.35;
  const Record whole = in_millivolt(load_record(spec));
  return {.name = "silverbox",
          .description = "Duffing-like circuit; trained on multisines, tested on the arrow",
          .train = slice(whole, 40650, 105712),
          .test = slice(whole, 100, 40575),
          .warmup = kMeasuredWarmup,
          .unit = "mV"};
}

Problem robot_arm(const fs::path& folder) {
  constexpr Eigen::Index kPeriod = 4096;
  LoadSpec spec;
  spec.path = existing(folder, "robot_arm/contsid_robotarm.mat");
  spec.input = "Input";
  spec.output = "Output";
  spec.sample_time_from = "Ts";
  Record whole = load_record(spec);
  whole.period = kPeriod;
  const auto period = [&](Eigen::Index k) { return slice(whole, (k - 1) * kPeriod, k * kPeriod); };
  return {.name = "robot_arm",
          .description = "flexible robot arm, torque to acceleration, one period of a multisine in steady state",
          .train = period(5),
          .test = period(7),
          .unit = ""};
}

}  // namespace blockid::problems
