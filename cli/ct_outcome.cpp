#include <blockid/cli/ct_outcome.hpp>

#include <blockid/blocks/text.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/text_table.hpp>

#include <ostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string metrics_text(const Metrics& metrics, const std::string& unit) {
  return "RMSE " + with_unit(number(metrics.rmse), unit) + "  NRMSE " + number(metrics.nrmse) + "  fit " +
         number(metrics.fit_percent) + " %  R2 " + number(metrics.r2) + "  (" + std::to_string(metrics.samples) +
         " samples)";
}

Json scored_json(const Evaluation& evaluation, const std::vector<Range>& ranges) {
  Json result = metrics_json(evaluation.total);
  result["ranges"] = Json::array();
  for (const Range& range : ranges) result["ranges"].push_back(blockid::to_text(range));
  return result;
}

/// By rising powers of s, as long as the degrees say; empty when they overflow.
void add_polynomials(Json& result, const ContinuousSummary& summary, const ContinuousTransferFunction& g) {
  if (summary.coefficients.empty()) return;
  std::vector<double> numerator(static_cast<std::size_t>(g.basis.numerator_degree + 1), 0.0);
  std::vector<double> denominator(static_cast<std::size_t>(g.basis.order + 1), 0.0);
  denominator.back() = 1.0;
  for (const Coefficient& one : summary.coefficients) {
    std::vector<double>& list = one.name.front() == 'b' ? numerator : denominator;
    list[std::stoul(one.name.substr(1))] = one.value;
  }
  result["numerator"] = numerator;
  result["denominator"] = denominator;
}

}  // namespace

void print_ct(std::ostream& stream, const CtOutcome& outcome) {
  const Model& model = outcome.model;
  stream << outcome.source << ": " << model.input_name << " -> " << model.output_name << ", sampled every "
         << number(model.sample_time_s) << " s, input between samples " << blockid::to_text(outcome.estimate.hold)
         << "\nmethod " << outcome.method << '\n';
  for (const std::string& fact : outcome.estimate.facts) stream << fact << '\n';
  print_summary(stream, outcome.estimate.summary);
  stream << "train " << metrics_text(outcome.train.total, model.output_unit) << '\n';
  if (outcome.test) stream << "test  " << metrics_text(outcome.test->total, model.output_unit) << '\n';
  print_verdict(stream, outcome.tests);
}

Json ct_json(const CtOutcome& outcome) {
  const CtEstimate& estimate = outcome.estimate;
  const Model& model = outcome.model;
  Json result = {{"format", "blockid-ct"}, {"version", BLOCKID_VERSION}};
  result["model"] = blockid::to_text(model.chain);
  result["method"] = outcome.method;
  result["order"] = estimate.transfer_function.basis.order;
  result["delay"] = estimate.delay;
  result["sample_time_s"] = model.sample_time_s;
  result["hold"] = blockid::to_text(estimate.hold);
  add_polynomials(result, estimate.summary, estimate.transfer_function);
  add_summary(result, estimate.summary);
  for (const auto& [name, value] : estimate.details.items()) result[name] = value;
  result["train"] = scored_json(outcome.train, outcome.train_ranges);
  if (outcome.test) result["test"] = scored_json(*outcome.test, outcome.test_ranges);
  result["residual_tests"] = tests_json(outcome.tests);
  result["data"] = {{"source", outcome.source},
                    {"input", model.input_name},
                    {"output", model.output_name},
                    {"sample_time_s", model.sample_time_s},
                    {"initial_state", initial_state_text(outcome.prediction.initial_state)}};
  result["units"] = {{"input", model.input_unit}, {"output", model.output_unit}};
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace blockid::cli
