#include <blockid/cli/closed_loop_records.hpp>

#include <blockid/cli/load_data.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/load.hpp>

#include <algorithm>
#include <cmath>
#include <locale>
#include <sstream>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

/// NAME, or GAIN*NAME.
VectorXd reference_of(const DataOptions& data, const std::string& text) {
  const std::size_t star = text.find('*');
  double gain = 1.0;
  if (star != std::string::npos) {
    std::istringstream stream(text.substr(0, star));
    stream.imbue(std::locale::classic());
    if (!(stream >> gain) || !(stream >> std::ws).eof()) {
      fail("--reference ", text, ": expected NAME or GAIN*NAME with a number for GAIN");
    }
  }
  const std::string name = star == std::string::npos ? text : text.substr(star + 1);
  return gain * thinned(load_column(data.file, name), data.every);
}

VectorXd less_rest(const VectorXd& x, Index rest) {
  if (rest == 0 || x.size() == 0) return x;
  return x.array() - x.head(std::min(rest, x.size())).mean();
}

LoopRecord cut(const Record& whole, const VectorXd& reference, const Range& range, Index rest) {
  const Record part = slice(whole, range);
  if (!part.y.allFinite() || (part.weights.size() > 0 && !(part.weights.array() > 0.0).all())) {
    fail("closed-loop: expected an output without missing samples, since v needs them all");
  }
  LoopRecord record{less_rest(part.u, rest), less_rest(part.y, rest), {}};
  if (reference.size() > 0) {
    if (reference.size() != whole.u.size()) {
      fail("--reference: expected ", whole.u.size(), " samples as in the input, got ", reference.size());
    }
    record.r = less_rest(reference.segment(range.begin, range.end - range.begin), rest);
  }
  return record;
}

/// The i-th of `values`, the only one, or none. `count`: experiments.
template <class T>
std::optional<T> value_of(const char* option, const std::vector<T>& values, std::size_t i, std::size_t count) {
  if (values.size() > 1 && count == 1) fail(option, ": expected one for the one experiment, got ", values.size());
  if (values.size() > 1 && values.size() != count) {
    fail(option, ": expected one for all experiments, or one for each of the ", count, " experiments, got ",
         values.size());
  }
  if (values.empty()) return std::nullopt;
  return values.size() == 1 ? values.front() : values[i];
}

struct LoadedFile {
  DataOptions data;
  LoadedRecord loaded;
  VectorXd reference;
};

std::vector<LoadedFile> load_files(const ClosedLoopCommand& command, std::optional<double> sample_time_s) {
  constexpr double kSame = 1e-6;
  std::vector<LoadedFile> files;
  for (const std::string& name : command.files) {
    DataOptions data = command.data;
    data.file = name;
    LoadedRecord loaded = load(data, sample_time_s);
    VectorXd reference = command.reference ? reference_of(data, *command.reference) : VectorXd();
    const double first = files.empty() ? loaded.record.sample_time_s : files.front().loaded.record.sample_time_s;
    if (std::abs(loaded.record.sample_time_s / first - 1.0) > kSame) {
      fail(name, ": sampled every ", loaded.record.sample_time_s, " s, ", command.files.front(), " every ", first,
           " s; expected one sample time");
    }
    files.push_back({data, std::move(loaded), std::move(reference)});
  }
  return files;
}

/// "FILE: message" when there are several files.
template <class F>
auto naming(const std::vector<LoadedFile>& files, const LoadedFile& file, F&& make) {
  try {
    return make();
  } catch (const Error& error) {
    if (files.size() == 1) throw;
    fail(file.data.file, ": ", error.what());
  }
}

}  // namespace

std::vector<LoopExperiment> loop_experiments(const ClosedLoopCommand& command, std::optional<double> sample_time_s) {
  const std::size_t count =
      command.files.size() == 1 ? std::max<std::size_t>(1, command.ranges.size()) : command.files.size();
  // Counts that do not fit are told before files are read.
  value_of("--range", command.ranges, 0, count);
  value_of("--gamma", command.gamma, 0, count);
  value_of("--quiet-run", command.quiet_runs, 0, count);
  const std::vector<LoadedFile> files = load_files(command, sample_time_s);
  std::vector<LoopExperiment> experiments;
  for (std::size_t i = 0; i < count; ++i) {
    const LoadedFile& file = files.size() == 1 ? files.front() : files[i];
    const Record& whole = file.loaded.record;
    experiments.push_back(naming(files, file, [&] {
      const std::string text = value_of("--range", command.ranges, i, count).value_or("");
      const Range range = parsed_range("--range", text, sample_count(whole));
      LoopExperiment one{.source = file.data.file,
                         .range = blockid::to_text(range),
                         .sample_time_s = whole.sample_time_s,
                         .record = cut(whole, file.reference, range, command.rest)};
      one.gamma = value_of("--gamma", command.gamma, i, count);
      one.warnings = file.loaded.warnings;
      if (const std::optional<std::string> quiet = value_of("--quiet-run", command.quiet_runs, i, count)) {
        one.quiet = cut(whole, {}, parsed_range("--quiet-run", *quiet, sample_count(whole)), command.rest);
        one.quiet_range = *quiet;
      }
      return one;
    }));
  }
  return experiments;
}

}  // namespace blockid::cli
