#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/judgement.hpp>

#include <blockid/blocks/text.hpp>

#include <cmath>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

Json ranges_json(const std::vector<Range>& ranges) {
  Json list = Json::array();
  for (const Range& range : ranges) list.push_back(blockid::to_text(range));
  return list;
}

nlohmann::ordered_json structures_json(const FitOutcome& outcome) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const StructureScore& score : outcome.structures) {
    list.push_back({{"model", score.chain},
                    {"validation_rmse", finite_or_null(score.validation_rmse)},
                    {"parameters", score.parameters},
                    {"taken", score.taken}});
  }
  return list;
}

Json shares_json(const std::vector<RootShare>& shares) {
  Json list = Json::array();
  for (const RootShare& share : shares) {
    list.push_back({{"kind", share.pole ? "pole" : "zero"},
                    {"real", share.value.real()},
                    {"imaginary", share.value.imag()},
                    {"exponent", finite_or_null(share.exponent)},
                    {"filter", share.in_first ? "first" : "second"}});
  }
  return list;
}

Json candidates_json(const FitOutcome& outcome) {
  Json list = Json::array();
  for (const Trial& trial : outcome.fit.trials) {
    Json entry = {{"how", trial.candidate.how}, {"rmse", finite_or_null(trial.candidate.rmse)}};
    entry["refitted"] = trial.refitted;
    entry["final_rmse"] = trial.refitted ? finite_or_null(trial.refit.rmse) : Json();
    entry["status"] = trial.refitted ? Json(blockid::to_text(trial.refit.status)) : Json();
    entry["iterations"] = trial.iterations();
    if (!trial.candidate.root_shares.empty()) entry["root_shares"] = shares_json(trial.candidate.root_shares);
    list.push_back(std::move(entry));
  }
  return list;
}

Json parameters_json(const FitOutcome& outcome) {
  Json list = Json::array();
  const Model& model = outcome.model();
  const std::vector<std::string> names = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    const bool free = is_free(outcome, k);
    const bool known = free && model.standard_deviations.size() > 0;
    list.push_back({{"name", names[static_cast<std::size_t>(k)]},
                    {"value", finite_or_null(model.parameters[k])},
                    {"standard_deviation", known ? finite_or_null(model.standard_deviations[k]) : Json()},
                    {"held", !free}});
  }
  return list;
}

}  // namespace

Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json metrics_json(const Metrics& metrics) {
  return {{"rmse", finite_or_null(metrics.rmse)},
          {"nrmse", finite_or_null(metrics.nrmse)},
          {"fit_percent", finite_or_null(metrics.fit_percent)},
          {"r2", finite_or_null(metrics.r2)},
          {"vaf", finite_or_null(metrics.vaf)},
          {"mae", finite_or_null(metrics.mae)},
          {"samples", metrics.samples},
          {"warmup", metrics.warmup}};
}

Json fit_json(const FitOutcome& outcome, const FitJudgement& tests) {
  const RefitReport& report = outcome.fit.report;
  Json result;
  result["format"] = "blockid-result";
  result["version"] = BLOCKID_VERSION;
  result["model"] = blockid::to_text(outcome.model().chain);
  result["requested_model"] = outcome.requested_model;
  result["parameters"] = free_count(outcome);
  result["parameters_total"] = outcome.model().parameters.size();
  result["status"] = blockid::to_text(report.status);
  result["message"] = report.message;
  result["iterations"] = outcome.fit.iterations();
  result["wall_seconds"] = outcome.fit.wall_seconds;
  result["train"] = metrics_json(outcome.train.total);
  result["train"]["ranges"] = ranges_json(outcome.train_ranges);
  if (outcome.test) {
    result["test"] = metrics_json(outcome.test->total);
    result["test"]["ranges"] = ranges_json(outcome.test_ranges);
  }
  result["noise_standard_deviation"] = finite_or_null(noise_standard_deviation(outcome));
  if (!outcome.structures.empty()) result["structures"] = structures_json(outcome);
  result["candidates"] = candidates_json(outcome);
  result["parameter_table"] = parameters_json(outcome);
  if (report.covariance) {
    result["covariance"] = {{"kind", outcome.robust ? "robust" : "white"},
                            {"rank", report.covariance->rank},
                            {"free_count", report.covariance->free_count},
                            {"condition", finite_or_null(report.covariance->condition)},
                            {"undetermined", report.covariance->undetermined}};
  }
  result["residual_tests"] = tests_json(tests);
  result["data"] = {{"source", outcome.source},
                    {"input", outcome.input_name},
                    {"output", outcome.output_name},
                    {"sample_time_s", outcome.sample_time_s},
                    {"initial_state", initial_state_text(outcome.prediction.initial_state)}};
  result["units"] = {{"input", outcome.input_unit}, {"output", outcome.output_unit}};
  result["init"] = outcome.init;
  result["seed"] = outcome.seed;
  result["threads"] = outcome.threads;
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace blockid::cli
