#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/judgement.hpp>
#include <blockid/cli/load_data.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report_fit.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>

#include <iostream>

namespace blockid::cli {
namespace {

/// The records to judge and those that the model was fitted to, either of which may be empty.
SplitData ranges_of(const ValidateCommand& command, const LoadedRecord& loaded) {
  SplitData data = split(loaded, {.train = command.train, .test = command.ranges});
  if (!command.train.empty()) return data;
  if (command.ranges.empty()) {
    data.test = data.train;
    data.test_ranges = data.train_ranges;
  }
  data.train = DataSet();
  data.train_ranges.clear();
  data.warnings = loaded.warnings;
  return data;
}

std::string task_text(const ValidateCommand& command, const SplitData& data, const Record& record) {
  std::string text = command.data.file + ", sampled every " + number(record.sample_time_s) + " s";
  if (!data.train_ranges.empty()) text += "; fitted to samples " + to_text(data.train_ranges);
  if (!data.test_ranges.empty()) text += "; judged on samples " + to_text(data.test_ranges);
  return text;
}

std::string report(const ValidateCommand& command, const Model& model, const Judgement& judgement,
                   const std::string& task) {
  HtmlPage page("Validation of " + command.model);
  page.paragraph(task + ".");
  page.code(blockid::to_text(model.chain));
  const bool gnuplot = gnuplot_is_there();
  if (!gnuplot) page.warning(kGnuplotMissing);
  const std::string& unit = command.data.output_unit.empty() ? model.output_unit : command.data.output_unit;
  add_judgement(page, judgement, unit, gnuplot);
  return page.text();
}

bool is_range(const std::string& text) {
  return text.find(':') != std::string::npos && text.find_first_not_of("0123456789:") == std::string::npos;
}

/// Samples of the output while the input rests: of the data, or of a file of their own.
Eigen::VectorXd noise_record_of(const ValidateCommand& command, const LoadedRecord& loaded) {
  const std::string& text = command.noise_record;
  if (text.empty()) return {};
  Record record;
  if (is_range(text)) {
    const Range range = parsed_range("--noise-record", text, sample_count(loaded.record));
    record = slice(loaded.record, range);
    if (record.u.size() > 0 && record.u.maxCoeff() != record.u.minCoeff()) {
      fail("--noise-record ", text, ": expected samples where the input rests, it moves between ", record.u.minCoeff(),
           " and ", record.u.maxCoeff());
    }
  } else {
    DataOptions options = command.data;
    options.file = text;
    // Noise has no input: its output stands for both.
    options.input = *command.data.output;
    record = load(options, loaded.record.sample_time_s).record;
  }
  if (!record.y.allFinite() || (record.weights.size() > 0 && !(record.weights.array() > 0.0).all())) {
    fail("--noise-record ", text, ": expected noise without missing samples");
  }
  return record.y;
}

}  // namespace

int run_validate(const ValidateCommand& command) {
  const Model model = load_model(command.model);
  check_outputs({command.json, command.report});
  if (!command.report.empty()) announce_missing_gnuplot(std::cerr);
  JudgementOptions options;
  options.prediction = prediction_options(command.scoring, command.data.period);
  options.tests.lags = command.lags;
  options.tests.significance = command.significance;
  options.held = held_places(model);
  options.noise_deviation = command.noise;
  const LoadedRecord loaded = load(command.data, model.sample_time_s);
  const SplitData data = ranges_of(command, loaded);
  options.noise_record = noise_record_of(command, loaded);
  Judgement judgement = judge(model, data.train, data.test, options);
  judgement.warnings.insert(judgement.warnings.begin(), data.warnings.begin(), data.warnings.end());

  const std::string task = task_text(command, data, loaded.record);
  for (const std::string& warning : judgement.warnings) std::cerr << "blockid: " << warning << '\n';
  if (!command.quiet) {
    std::cout << command.model << " on " << task << '\n' << "model    " << blockid::to_text(model.chain) << '\n';
    print_judgement(std::cout, judgement);
  }
  if (!command.json.empty()) {
    nlohmann::ordered_json result = {
        {"format", "blockid-validation"},
        {"version", BLOCKID_VERSION},
        {"model", blockid::to_text(model.chain)},
        {"data", command.data.file},
        {"train", to_text(data.train_ranges)},
        {"judged", to_text(data.test_ranges.empty() ? data.train_ranges : data.test_ranges)}};
    result.update(judgement_json(judgement));
    write_output(command.json, json_text(result));
  }
  if (!command.report.empty()) write_output(command.report, report(command, model, judgement, task));
  return judgement.passed() ? kSuccess : kInvalidated;
}

}  // namespace blockid::cli
