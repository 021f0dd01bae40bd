#include <blockid/cli/judgement.hpp>

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/report/residual_figures.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/rational.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/tail_probability.hpp>
#include <blockid/estimators/gauges.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/validation/model_residuals.hpp>

#include <algorithm>
#include <cmath>
#include <ostream>

namespace blockid::cli {
namespace {

/// Residual over output above which a model is worse than none: errors of parameters take it little above one.
constexpr double kWorseThanNothing = 2.0;

/// Standard deviations from the minimum beyond which a model was not fitted to the records.
constexpr double kAtMinimum = 0.1;

std::vector<FilterRoots> filters_of(const Model& model) {
  std::vector<FilterRoots> filters;
  for (const LeafBlock& leaf : leaf_blocks(model)) {
    const std::optional<LinearRoots> roots = linear_roots(leaf.block, leaf.parameters);
    if (roots) filters.push_back({leaf.path, roots->zeros, roots->poles});
  }
  return filters;
}

DataSet data_of(const Evaluation& evaluation) {
  DataSet data;
  for (const ScoredRecord& scored : evaluation.records) data.records.push_back(scored.record);
  return data;
}

/// What placed_on() takes for the start of each record, when states are estimated.
ParameterKnowledge knowledge_of(const Model& model, const DataSet& data, const JudgementOptions& options) {
  ParameterKnowledge knowledge{.held = options.held, .initial_states = {}};
  if (options.prediction.initial_state != InitialState::estimated) return knowledge;
  for (const Record& record : data.records) {
    knowledge.initial_states.push_back(placed_on(model, record, options.prediction).initial_state);
  }
  return knowledge;
}

std::vector<std::string> names_at(const Model& model, const std::vector<Index>& places) {
  const std::vector<std::string> all = model.chain.parameter_names();
  std::vector<std::string> names;
  for (const Index k : places) names.push_back(all[static_cast<std::size_t>(k)]);
  return names;
}

/// Covariance of the parameters from the training data; robust when their residual is coloured.
Eigen::MatrixXd covariance_of(const Model& model, const DataSet& training, const ParameterKnowledge& knowledge,
                              const JudgementOptions& options, bool coloured) {
  CovarianceOptions settings;
  settings.prediction = options.prediction;
  settings.frozen = names_at(model, options.held);
  settings.hold_gauges = false;
  settings.robust = coloured;
  settings.batch = batch_length(training);
  settings.initial_states = knowledge.initial_states;
  return covariance(model, training, settings).parameters;
}

std::vector<Index> free_places(const Model& model, const std::vector<Index>& held) {
  std::vector<Index> free;
  for (Index k = 0; k < model.parameters.size(); ++k) {
    if (!std::binary_search(held.begin(), held.end(), k)) free.push_back(k);
  }
  return free;
}

/// Filters whose parameters are their coefficients.
std::vector<EstimatedFilter> estimated_filters(const Model& model, const Eigen::MatrixXd& covariance) {
  std::vector<EstimatedFilter> filters;
  if (!covariance.allFinite()) return filters;
  for (const LeafBlock& leaf : leaf_blocks(model)) {
    const auto* rational = leaf.block.target<Rational>();
    if (rational == nullptr || !leaf.parameters.allFinite()) continue;
    Eigen::VectorXd denominator = Eigen::VectorXd::Ones(rational->na() + 1);
    denominator.tail(rational->na()) = leaf.parameters.tail(rational->na());
    const Index count = leaf.parameters.size();
    filters.push_back({leaf.path, leaf.parameters.head(rational->nb() + 1), denominator,
                       covariance.block(leaf.offset, leaf.offset, count, count)});
  }
  return filters;
}

void add_periodic(Judgement& judgement, const std::vector<ResidualRecord>& records, const DataSet& data,
                  double significance) {
  const Index period = data.records.front().period;
  if (period < 3) return;
  try {
    judgement.periodic = periodic_error(records, period, data.records.front().sample_time_s, significance);
  } catch (const Error& error) {
    judgement.warnings.push_back("no noise spectrum from the periods: " + std::string(error.what()));
  }
}

double residual_over_output(const std::vector<ResidualRecord>& records) {
  double residual = 0.0;
  double output = 0.0;
  for (const ResidualRecord& record : records) {
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(record.residual.size());
    const Eigen::VectorXd scored =
        record.weights.size() == 0 ? ones : Eigen::VectorXd((record.weights.array() > 0.0).cast<double>());
    const Eigen::VectorXd r = (scored.array() > 0.0).select(record.residual, 0.0);
    const Eigen::VectorXd y = (scored.array() > 0.0).select(record.yhat + record.residual, 0.0);
    const double mean = scored.sum() > 0.0 ? y.sum() / scored.sum() : 0.0;
    residual += r.squaredNorm();
    output += (scored.array() * (y.array() - mean)).square().sum();
  }
  return std::sqrt(residual / output);
}

void add_size_hint(Judgement& judgement) {
  if (!judgement.worse_than_nothing()) return;
  judgement.under_fit.push_back("size: the residual is " + number(judgement.residual_over_output, 4) +
                                " times as large as the output, so the model explains nothing of it; an unstable "
                                "model, another input or another sample time does that");
}

void add_spectrum_hint(Judgement& judgement) {
  if (judgement.periodic && !judgement.periodic->passed) {
    judgement.under_fit.emplace_back(
        "error spectrum: what the residual repeats from period to period exceeds the noise, so it is the model's");
  }
  if (judgement.noise && !judgement.noise->passed) {
    judgement.under_fit.push_back("noise level: the residual is " + number(judgement.noise->ratio, 4) +
                                  " times as large as the noise");
  }
  if (judgement.noise_spectrum && !judgement.noise_spectrum->passed) {
    const NoiseSpectrumTest& spectrum = *judgement.noise_spectrum;
    Index band = 0;
    spectrum.p_values.minCoeff(&band);
    judgement.under_fit.push_back(
        "noise spectrum: around " + number(spectrum.frequency_hz[band], 4) + " Hz the residual has " +
        number(spectrum.residual_density[band] / spectrum.noise_density[band], 4) + " times the power of the noise");
  }
}

void warn_of_distance(Judgement& judgement) {
  if (!(judgement.tests.distance_from_minimum > kAtMinimum)) return;
  judgement.warnings.push_back("the parameters lie " + number(judgement.tests.distance_from_minimum, 3) +
                               " standard deviations from the best ones for these records: the model was fitted to "
                               "others, or the fit has not converged");
}

std::string degrees_text(Index degrees) { return std::to_string(degrees); }

std::string p_value_cell(double p) { return p < 1e-4 ? "< 1e-4" : number(p, 3); }

std::vector<std::vector<std::string>> test_rows(const Judgement& judgement) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const std::string& name, double statistic, const std::string& degrees, double p, bool passed) {
    rows.push_back({name, number(statistic, 5), degrees, p_value_cell(p), passed ? "passed" : "FAILED"});
  };
  for (const ResidualTest& test : judgement.tests.tests) {
    add(to_text(test.kind), test.statistic, degrees_text(test.degrees_of_freedom), test.p_value, test.passed);
    if (test.kind == ResidualTestKind::whiteness && !test.passed) rows.back().back() = "coloured";
  }
  if (judgement.worse_than_nothing()) {
    rows.push_back({"size", number(judgement.residual_over_output, 5), "-", "-", "FAILED"});
  }
  if (judgement.periodic) {
    add("error spectrum", judgement.periodic->statistic, degrees_text(judgement.periodic->degrees_of_freedom),
        judgement.periodic->p_value, judgement.periodic->passed);
  }
  if (judgement.noise) {
    const NoiseLevelTest& noise = *judgement.noise;
    add("noise level", noise.samples * noise.ratio * noise.ratio, number(noise.samples, 5), noise.p_value,
        noise.passed);
  }
  if (judgement.noise_spectrum) {
    const NoiseSpectrumTest& spectrum = *judgement.noise_spectrum;
    add("noise spectrum", spectrum.statistic, degrees_text(spectrum.degrees_of_freedom), spectrum.p_value,
        spectrum.passed);
  }
  return rows;
}

std::string noise_text(const Judgement& judgement) {
  const ResidualTests& tests = judgement.tests;
  return "residual " + number(tests.deviation) + " (standard deviation) over " + std::to_string(tests.samples) +
         " samples, as an autoregression of order " + std::to_string(tests.noise.order());
}

/// What the statistic of a test may be at most; null where there is nothing to test.
nlohmann::ordered_json limit_json(Index degrees, double significance) {
  if (degrees == 0) return nullptr;
  return finite_or_null(chi_square_point(significance, static_cast<double>(degrees)));
}

nlohmann::ordered_json list_json(const Eigen::VectorXd& values) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const double value : values) list.push_back(finite_or_null(value));
  return list;
}

}  // namespace

bool Judgement::worse_than_nothing() const { return !(residual_over_output <= kWorseThanNothing); }

bool Judgement::passed() const {
  return !worse_than_nothing() && tests.model_passed() && (!periodic || periodic->passed) &&
         (!noise || noise->passed) && (!noise_spectrum || noise_spectrum->passed);
}

std::vector<Index> held_places(const Model& model) {
  std::vector<Index> held;
  if (model.standard_deviations.size() == model.parameters.size()) {
    for (Index k = 0; k < model.parameters.size(); ++k) {
      if (model.standard_deviations[k] == 0.0) held.push_back(k);
    }
    return held;
  }
  held = gain_gauges(model.chain, model.parameters, {});
  std::sort(held.begin(), held.end());
  return held;
}

FitJudgement judge_fit(const FitOutcome& outcome) {
  JudgementOptions options;
  options.prediction = outcome.prediction;
  options.held = outcome.held;
  const std::optional<Covariance>& covariance = outcome.fit.report.covariance;
  if (covariance) options.undetermined = covariance->undetermined;
  FitJudgement result;
  try {
    result.judgement =
        judge(outcome.model(), data_of(outcome.train), outcome.test ? data_of(*outcome.test) : DataSet(), options);
  } catch (const Error& error) {
    result.problem = error.what();
  }
  return result;
}

Judgement judge(const Model& model, const DataSet& training, const DataSet& test, const JudgementOptions& options) {
  Judgement result;
  std::optional<ResidualTests> of_training;
  std::vector<ResidualRecord> shown;
  ResidualTestOptions settings = options.tests;
  ParameterKnowledge knowledge;
  Eigen::MatrixXd of_parameters;
  bool coloured = false;
  if (!training.records.empty()) {
    knowledge = knowledge_of(model, training, options);
    shown = training_residuals(model, training, options.prediction, knowledge);
    of_training = residual_tests(shown, settings);
    result.set = "training";
    result.parameters = "fitted to these records: the directions that they have used up are not tested";
    result.tests = *of_training;
    warn_of_distance(result);
    const ResidualTest* const whiteness = of_training->find(ResidualTestKind::whiteness);
    coloured = whiteness != nullptr && !whiteness->passed;
    of_parameters = covariance_of(model, training, knowledge, options, coloured);
  }
  if (!test.records.empty()) {
    const ParameterKnowledge here = knowledge_of(model, test, options);
    shown = test_residuals(model, test, options.prediction, here);
    if (of_training) {
      const std::vector<Index> free = free_places(model, options.held);
      settings.covariance = of_parameters(free, free);
      result.set = "test";
      result.parameters = std::string("fitted to the training data; their covariance there (") +
                          (coloured ? "robust" : "for white residuals") + ") is part of the bands";
    } else {
      for (ResidualRecord& record : shown) record.fitted_elsewhere.resize(record.residual.size(), 0);
      result.set = "given";
      result.parameters = "taken as exact, since the training data are not known: their errors count as the model's";
    }
    result.tests = residual_tests(shown, settings);
  }
  const DataSet& data = test.records.empty() ? training : test;
  result.residual_over_output = residual_over_output(shown);
  add_periodic(result, shown, data, settings.significance);
  if (options.noise_deviation) result.noise = noise_level_test(result.tests, *options.noise_deviation);
  if (options.noise_record.size() > 0) {
    result.noise_spectrum =
        noise_spectrum_test(shown, options.noise_record, data.records.front().sample_time_s, settings.significance);
  }
  const bool both = of_training && !test.records.empty();
  if (both) result.errors = compare_errors(*of_training, result.tests);
  result.under_fit = under_fit_hints(result.tests);
  add_size_hint(result);
  add_spectrum_hint(result);
  result.over_fit = over_fit_hints(
      {.model = model,
       .filters = filters_of(model),
       .estimated = of_training ? estimated_filters(model, of_parameters) : std::vector<EstimatedFilter>(),
       .undetermined = options.undetermined,
       .training = both ? &*of_training : nullptr,
       .test = both ? &result.tests : nullptr});
  return result;
}

std::string verdict_text(const Judgement& judgement) {
  if (judgement.passed()) return "all tests of the model passed";
  std::string failed;
  for (const std::vector<std::string>& row : test_rows(judgement)) {
    if (row.back() == "FAILED") failed += (failed.empty() ? "" : ", ") + row.front();
  }
  return "the records contradict the model: " + failed;
}

FitJudgement judge_simulations(const Evaluation& train, const std::optional<Evaluation>& test) {
  Judgement judgement;
  judgement.set = test ? "test" : "training";
  judgement.parameters = "count as exact";
  std::vector<ResidualRecord> records;
  for (const ScoredRecord& scored : (test ? *test : train).records) {
    if (!scored.yhat.allFinite()) return {std::nullopt, "the simulation is not finite"};
    records.push_back({scored.record.u, scored.yhat, scored_residual(scored), scored_mask(scored), {}, {}});
  }
  try {
    judgement.tests = residual_tests(records);
  } catch (const Error& error) {
    // Too few samples, or a perfect fit.
    return {std::nullopt, error.what()};
  }
  judgement.residual_over_output = residual_over_output(records);
  judgement.under_fit = under_fit_hints(judgement.tests);
  add_size_hint(judgement);
  return {std::move(judgement), {}};
}

void print_judgement(std::ostream& stream, const Judgement& judgement) {
  stream << "verdict  " << verdict_text(judgement) << '\n'
         << "data     " << judgement.set << "; " << noise_text(judgement) << '\n'
         << "parameters  " << judgement.parameters << '\n';
  TextTable table;
  table.columns = {{"test", Align::left},
                   {"statistic", Align::right},
                   {"degrees of freedom", Align::right},
                   {"p", Align::right},
                   {"", Align::left}};
  table.rows = test_rows(judgement);
  print(stream, table);
  if (judgement.errors) {
    stream << "test error over training error " << number(judgement.errors->ratio, 4) << ", expected "
           << number(judgement.errors->expected, 4) << '\n';
  }
  for (const std::string& hint : judgement.under_fit) stream << "too little  " << hint << '\n';
  for (const std::string& hint : judgement.over_fit) stream << "too much    " << hint << '\n';
}

void print_verdict(std::ostream& stream, const FitJudgement& tests) {
  if (!tests.judgement) {
    stream << "no residual tests: " << tests.problem << '\n';
    return;
  }
  stream << "residual tests on the " << tests.judgement->set << " data: " << verdict_text(*tests.judgement) << '\n';
}

nlohmann::ordered_json judgement_json(const Judgement& judgement) {
  using Json = nlohmann::ordered_json;
  Json tests = Json::array();
  for (const ResidualTest& test : judgement.tests.tests) {
    tests.push_back({{"test", to_text(test.kind)},
                     {"statistic", finite_or_null(test.statistic)},
                     {"degrees_of_freedom", test.degrees_of_freedom},
                     {"limit", limit_json(test.degrees_of_freedom, judgement.tests.significance)},
                     {"p_value", finite_or_null(test.p_value)},
                     {"passed", test.passed},
                     {"explanation", explanation(test)},
                     {"lags", list_json(test.lags)},
                     {"correlations", list_json(test.correlations)},
                     {"bands", list_json(test.bands)}});
  }
  Json result = {{"passed", judgement.passed()},
                 {"verdict", verdict_text(judgement)},
                 {"set", judgement.set},
                 {"parameters", judgement.parameters},
                 {"significance", judgement.tests.significance},
                 {"samples", judgement.tests.samples},
                 {"residual_deviation", finite_or_null(judgement.tests.deviation)},
                 {"residual_over_output", finite_or_null(judgement.residual_over_output)},
                 {"noise_order", judgement.tests.noise.order()},
                 {"distance_from_minimum", finite_or_null(judgement.tests.distance_from_minimum)},
                 {"tests", tests}};
  if (judgement.periodic) {
    const PeriodicError& error = *judgement.periodic;
    result["error_spectrum"] = {{"periods", error.periods},
                                {"statistic", finite_or_null(error.statistic)},
                                {"degrees_of_freedom", error.degrees_of_freedom},
                                {"p_value", finite_or_null(error.p_value)},
                                {"passed", error.passed},
                                {"frequency_hz", list_json(error.frequency_hz)},
                                {"error_density", list_json(error.error_density)},
                                {"noise_density", list_json(error.noise_density)}};
  }
  if (judgement.noise) {
    result["noise_level"] = {{"ratio", finite_or_null(judgement.noise->ratio)},
                             {"effective_samples", finite_or_null(judgement.noise->samples)},
                             {"p_value", finite_or_null(judgement.noise->p_value)},
                             {"passed", judgement.noise->passed}};
  }
  if (judgement.noise_spectrum) {
    const NoiseSpectrumTest& spectrum = *judgement.noise_spectrum;
    result["noise_spectrum"] = {{"segment", spectrum.segment},
                                {"residual_segments", spectrum.residual_segments},
                                {"noise_segments", spectrum.noise_segments},
                                {"statistic", finite_or_null(spectrum.statistic)},
                                {"degrees_of_freedom", spectrum.degrees_of_freedom},
                                {"p_value", finite_or_null(spectrum.p_value)},
                                {"passed", spectrum.passed},
                                {"frequency_hz", list_json(spectrum.frequency_hz)},
                                {"residual_density", list_json(spectrum.residual_density)},
                                {"noise_density", list_json(spectrum.noise_density)},
                                {"p_values", list_json(spectrum.p_values)}};
  }
  if (judgement.errors) {
    result["test_over_training"] = {{"ratio", finite_or_null(judgement.errors->ratio)},
                                    {"expected", finite_or_null(judgement.errors->expected)},
                                    {"p_value", finite_or_null(judgement.errors->p_value)}};
  }
  result["under_fit"] = judgement.under_fit;
  result["over_fit"] = judgement.over_fit;
  result["warnings"] = judgement.warnings;
  return result;
}

nlohmann::ordered_json tests_json(const FitJudgement& tests) {
  using Json = nlohmann::ordered_json;
  if (!tests.judgement) return {{"problem", tests.problem}};
  Json result = judgement_json(*tests.judgement);
  for (Json& test : result["tests"]) {
    for (const char* key : {"lags", "correlations", "bands"}) test.erase(key);
  }
  if (result.contains("error_spectrum")) {
    for (const char* key : {"frequency_hz", "error_density", "noise_density"}) result["error_spectrum"].erase(key);
  }
  return result;
}

void add_judgement(HtmlPage& page, const Judgement& judgement, const std::string& unit, bool gnuplot) {
  page.heading("Residual tests");
  const std::string verdict = "Verdict at " + number(100.0 * judgement.tests.significance, 3) +
                              " % for each test: " + verdict_text(judgement) + ".";
  if (judgement.passed()) {
    page.paragraph(verdict);
  } else {
    page.warning(verdict);
  }
  page.paragraph("On the " + judgement.set + " data: " + noise_text(judgement) +
                 ". The parameters: " + judgement.parameters + ".");
  for (const std::string& warning : judgement.warnings) page.warning(warning);
  page.table({"test", "statistic", "degrees of freedom", "p", ""}, test_rows(judgement));
  if (judgement.errors) {
    page.paragraph("The test error is " + number(judgement.errors->ratio, 4) + " times the training error; " +
                   number(judgement.errors->expected, 4) + " is expected for the number of parameters.");
  }
  for (const std::string& hint : judgement.under_fit) page.paragraph("Too little: " + hint + ".");
  for (const std::string& hint : judgement.over_fit) page.paragraph("Too much: " + hint + ".");
  for (const Figure& figure : residual_figures(judgement.tests, judgement.set)) add_figure(page, figure, gnuplot);
  if (judgement.periodic) {
    add_figure(page, periodic_error_figure(*judgement.periodic, unit, judgement.set), gnuplot);
  }
  if (judgement.noise_spectrum) {
    add_figure(page, noise_spectrum_figure(*judgement.noise_spectrum, unit, judgement.set), gnuplot);
  }
}

}  // namespace blockid::cli
