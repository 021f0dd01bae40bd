#include <blockid/cli/program.hpp>

#include <blockid/cli/commands.hpp>
#include <blockid/cli/exit_codes.hpp>
#include <blockid/cli/initialisers.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/fit.hpp>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

namespace blockid::cli {
namespace {

constexpr const char* kDescription =
    "Identifies block-structured nonlinear dynamic systems (Wiener, Hammerstein, Wiener-Hammerstein, parallel\n"
    "branches) from measured input and output.";

/// Each occurrence takes one value, so that a following positional is not swallowed.
template <class T>
CLI::Option* add_repeated(CLI::App& app, const std::string& name, std::vector<T>& values, const std::string& help) {
  return app.add_option(name, values, help)->allow_extra_args(false);
}

/// Which signals a command needs.
enum class Signals { input_and_output, input, none };

constexpr const char* kDataFormats = "CSV (or columns separated by ; tab or blanks) or MAT v4, v5, v7, v7.3";

/// All of DataOptions but the file.
void add_signal_options(CLI::App& app, DataOptions& data, Signals signals, const std::string& sampling_default) {
  const std::string group = "Data";
  CLI::Option* const input_option =
      app.add_option("--input", data.input,
                     "input signal: CSV column name or 1-based number; MAT variable, struct.field, name[k]")
          ->type_name("NAME")
          ->group(group);
  CLI::Option* const output_option =
      app.add_option("--output", data.output, "output signal, named likewise")->type_name("NAME")->group(group);
  if (signals != Signals::none) input_option->required();
  if (signals == Signals::input_and_output) output_option->required();
  app.add_option("--rate", data.rate_hz, "sampling frequency in Hz" + sampling_default)->type_name("HZ")->group(group);
  app.add_option("--sample-time", data.sample_time_s, "sample time in seconds" + sampling_default)
      ->type_name("S")
      ->group(group);
  app.add_option("--rate-from", data.rate_from, "variable or column that holds the sampling frequency in Hz")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--sample-time-from", data.sample_time_from,
                 "variable or column that holds the sample time in seconds")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--time", data.time_from,
                 "column or variable of time stamps in seconds: they say the sample time, or are compared with the one "
                 "given, and must be uniform but for rounding")
      ->type_name("NAME")
      ->group(group);
  app.add_flag("--allow-missing", data.allow_missing,
               "output samples that are NaN or empty cells count as missing (default: an error)")
      ->group(group);
  app.add_option(
         "--every", data.every,
         "take every K-th sample of the file, without a filter; the rate is that of the file, period and ranges "
         "count the samples taken (default: 1)")
      ->type_name("K")
      ->check(CLI::PositiveNumber)
      ->group(group);
  app.add_option("--period", data.period, "samples in one period of the input (default: 0, aperiodic)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  app.add_option("--input-unit", data.input_unit, "unit of the input, for reports (default: none)")
      ->type_name("TEXT")
      ->group(group);
  app.add_option("--output-unit", data.output_unit, "unit of the output, for reports (default: none)")
      ->type_name("TEXT")
      ->group(group);
}

void add_data_options(CLI::App& app, DataOptions& data, Signals signals, const std::string& sampling_default) {
  app.add_option("DATA", data.file, std::string("data file: ") + kDataFormats)->required();
  add_signal_options(app, data, signals, sampling_default);
}

void add_ranges(CLI::App& app, RangeOptions& ranges) {
  const std::string group = "Ranges (samples, zero-based, half-open; repeatable, each a record of its own)";
  add_repeated(app, "--train", ranges.train, "samples to identify from (default: all)")->type_name("A:B")->group(group);
  add_repeated(app, "--test", ranges.test, "samples to judge the result on (default: none)")
      ->type_name("A:B")
      ->group(group);
}

void add_scoring(CLI::App& app, ScoringOptions& scoring, const std::vector<std::string>& states,
                 const std::string& state_default = "zero") {
  const std::string group = "Scoring";
  app.add_option("--warmup", scoring.warmup, "samples at the start of each record that are not scored (default: 0)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  std::string help =
      "state of the model before each record: zero (rest), estimated (fitted to the record's output), "
      "periodic (steady state, needs --period)";
  if (states.size() > 3) help += ", model (as in the model file)";
  app.add_option("--initial-state", scoring.initial_state, help + " (default: " + state_default + ")")
      ->type_name("WORD")
      ->check(CLI::IsMember(states))
      ->group(group);
}

CLI::Option* add_threads(CLI::App& app, RunOptions& run) {
  constexpr int kMostThreads = 1024;
  return app.add_option("--threads", run.threads, "threads (default: all processors)")
      ->type_name("N")
      ->check(CLI::Range(1, kMostThreads));
}

CLI::Option* add_quiet(CLI::App& app, bool& quiet) {
  return app.add_flag("--quiet", quiet, "no progress and no tables, errors only (default: off)");
}

CLI::Option* add_file(CLI::App& app, const std::string& name, std::string& file, const std::string& help) {
  return app.add_option(name, file, help + " (default: not written)")->type_name("FILE")->group("Results");
}

const std::vector<std::string> kStates = {"zero", "estimated", "periodic"};
const std::vector<std::string> kSimulationStates = {"zero", "estimated", "periodic", "model"};

void add_fit(CLI::App& program, FitCommand& command) {
  CLI::App& app = *program.add_subcommand("fit", "identify a model from measured data");
  app.footer(kExitCodesText);
  add_data_options(app, command.data, Signals::input_and_output, "");
  add_ranges(app, command.ranges);
  add_scoring(app, command.scoring, kStates);
  const std::string group = "Model and fit";
  app.add_option("--model", command.model,
                 "the chain to identify, e.g. \"G1=rational(nb=3,na=3) | f=spline(knots=20) | "
                 "G2=rational(nb=3,na=3)\", or wh: a "
                 "Wiener-Hammerstein chain with orders, delay, knots and oversampling chosen on held-back data; "
                 "left out only when --init names a model file")
      ->type_name("TEXT")
      ->group(group);
  app.add_option("--orders", command.orders,
                 "given: degrees and delay of the filters as in --model; auto: chosen on held-back data for a chain "
                 "rational | static block | rational (either filter may be missing), those in --model are replaced "
                 "(default: given)")
      ->type_name("WORD")
      ->check(CLI::IsMember({"given", "auto"}))
      ->group(group);
  app.add_option("--init", command.init,
                 "where the search starts: " + describe_initialisers() + " (default: fractional)")
      ->type_name("NAME|FILE.json")
      ->group(group);
  app.add_option("--starts", command.starts,
                 "starts that fractional, release, classify and random try (default: a few; random 16)")
      ->type_name("K")
      ->check(CLI::Range(1, 100000))
      ->group(group);
  app.add_option("--best", command.best,
                 "starting models that are refitted (default: " + std::to_string(FitOptions{}.best) + ")")
      ->type_name("K")
      ->check(CLI::PositiveNumber)
      ->group(group);
  app.add_option("--max-iterations", command.max_iterations,
                 "Levenberg-Marquardt iterations of one refit (default: " + std::to_string(command.max_iterations) +
                     "; 0 judges the start)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  add_repeated(app, "--freeze", command.frozen,
               "parameter that keeps its starting value, e.g. G1.b0; repeatable or separated by commas (default: none)")
      ->delimiter(',')
      ->type_name("NAME")
      ->group(group);
  app.add_flag("--robust-covariance", command.robust_covariance,
               "standard deviations that hold for coloured residuals, too: the sandwich covariance (default: that of "
               "white ones)")
      ->group(group);
  app.add_option("--seed", command.run.seed, "seed of initialisers that use random numbers (default: 1)")
      ->type_name("N")
      ->group(group);
  add_threads(app, command.run)->group(group);
  add_file(app, "-o,--save", command.outputs.model, "model file (JSON)");
  add_file(app, "--json", command.outputs.json, "all figures of the result as JSON");
  add_file(app, "--report", command.outputs.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.run.quiet)->group("Results");
}

void add_simulate(CLI::App& program, SimulateCommand& command) {
  CLI::App& app = *program.add_subcommand("simulate", "run a model on measured input");
  app.footer(kExitCodesText);
  app.add_option("MODEL", command.model, "model file (JSON) as written by fit")->required();
  add_data_options(app, command.data, Signals::input, " (default: the model's)");
  app.add_option("--range", command.range, "samples to simulate, zero-based, half-open (default: all)")
      ->type_name("A:B")
      ->group("Data");
  add_scoring(app, command.scoring, kSimulationStates);
  add_file(app, "-o,--save", command.csv,
           "CSV with the columns t_s, u, y (with --output), yhat, error (with --output)");
  add_file(app, "--json", command.json, "metrics as JSON");
  add_quiet(app, command.quiet)->group("Results");
}

void add_validate(CLI::App& program, ValidateCommand& command) {
  CLI::App& app = *program.add_subcommand(
      "validate", "residual tests: is a model good enough; exit code 5 when the data contradict it");
  app.footer(kExitCodesText);
  app.add_option("MODEL", command.model, "model file (JSON) as written by fit")->required();
  add_data_options(app, command.data, Signals::input_and_output, " (default: the model's)");
  const std::string group = "Ranges (samples, zero-based, half-open; repeatable, each a record of its own)";
  add_repeated(app, "--range", command.ranges, "samples to judge the model on (default: those of --train, else all)")
      ->type_name("A:B")
      ->group(group);
  add_repeated(app, "--train", command.train,
               "samples of DATA that the model was fitted to, with the same --warmup and --initial-state; without "
               "--range the tests are made on them, with it they say how uncertain the parameters are (default: not "
               "known, the parameters count as exact)")
      ->type_name("A:B")
      ->group(group);
  add_scoring(app, command.scoring, kStates);
  const std::string tests = "Tests";
  constexpr int kMostLags = 1000;
  app.add_option("--lags", command.lags, "longest lag in samples (default: 25)")
      ->type_name("K")
      ->check(CLI::Range(1, kMostLags))
      ->group(tests);
  app.add_option("--significance", command.significance,
                 "probability that a right model fails, for each test (default: 0.01)")
      ->type_name("P")
      ->group(tests);
  app.add_option("--noise", command.noise,
                 "standard deviation of the noise in units of the output, when it is known: the residual is compared "
                 "with it (default: none)")
      ->type_name("S")
      ->check(CLI::PositiveNumber)
      ->group(tests);
  app.add_option("--noise-record", command.noise_record,
                 "the output while the input rests, samples of DATA or a file with the same output signal and sample "
                 "time: the spectrum of the residual is compared with its (default: none)")
      ->type_name("A:B|FILE")
      ->group(tests);
  add_file(app, "--json", command.json, "all tests with correlations and bands as JSON");
  add_file(app, "--report", command.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.quiet)->group("Results");
}

void add_bla(CLI::App& program, BlaCommand& command) {
  CLI::App& app = *program.add_subcommand("bla", "best linear approximation: order table, poles, zeros, Bode picture");
  app.footer(kExitCodesText);
  add_data_options(app, command.data, Signals::input_and_output, "");
  add_ranges(app, command.ranges);
  add_scoring(app, command.scoring, kStates);
  app.add_option("--transient-periods", command.transient_periods,
                 "periods at the start of each range that the measured frequency response leaves out; with --period "
                 "(default: 0)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group("Scoring");
  const std::string group = "Orders";
  constexpr int kMostOrders = 50;
  CLI::Option* const max_order =
      app.add_option("--max-order", command.max_order, "largest degree nb = na of the order table (default: 6)")
          ->type_name("N")
          ->check(CLI::Range(1, kMostOrders))
          ->group(group);
  CLI::Option* const max_delay =
      app.add_option("--max-delay", command.max_delay, "largest delay in samples of the order table (default: 0)")
          ->type_name("K")
          ->check(CLI::NonNegativeNumber)
          ->group(group);
  app.add_option("--orders", command.orders,
                 "degrees of numerator and denominator and the delay in samples, instead of the order table "
                 "(default: chosen from the table by the test RMSE, by BIC when there is no --test)")
      ->type_name("NB,NA[,NK]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->excludes(max_order)
      ->excludes(max_delay)
      ->group(group);
  add_threads(app, command.run)->group(group);
  add_file(app, "--json", command.json, "all figures of the result as JSON");
  add_file(app, "--report", command.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.run.quiet)->group("Results");
}

void add_ct(CLI::App& program, CtCommand& command) {
  CLI::App& app = *program.add_subcommand("ct", "continuous-time linear model from sampled data");
  app.footer(kExitCodesText);
  add_data_options(app, command.data, Signals::input_and_output, "");
  add_ranges(app, command.ranges);
  add_scoring(app, command.scoring, kStates, "estimated; zero for goodwin and tustin");
  const std::string group = "Model and fit";
  app.add_option("--method", command.method,
                 "flbf: least squares in frequency localising functions, svf: with a state-variable filter, srivc: "
                 "refined instrumental variables in the former; goodwin: trends by the delta operator, tustin: by the "
                 "bilinear one (default: srivc)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"flbf", "svf", "srivc", "goodwin", "tustin"}))
      ->group(group);
  app.add_option("--orders", command.orders, "degrees of numerator and denominator, NB <= NA; NB < NA for trends")
      ->type_name("NB,NA")
      ->delimiter(',')
      ->expected(2)
      ->required()
      ->group(group);
  app.add_option("--break-points", command.break_points,
                 "flbf, srivc: NA break points with equal ratios from LO to HI in rad/s; svf: their geometric mean is "
                 "the pole of the filter (default: the band of the input)")
      ->type_name("LO:HI[:COUNT]")
      ->group(group);
  app.add_flag("--no-relocate", command.no_relocate,
               "flbf, srivc: keep the break points even where |A/E| drifts over decades (default: off)")
      ->group(group);
  app.add_option(
         "--hold", command.hold,
         "input between samples: zoh, foh, spline3, spline5, spline7, band_limited (default: spline3; trends: zoh)")
      ->type_name("WORD")
      ->group(group);
  app.add_flag("--iv", command.iv, "flbf, svf: instrumental variables after the least squares (default: off)")
      ->group(group);
  app.add_flag("--refit", command.refit,
               "end in least squares of the simulation error, whatever the method (default: off)")
      ->group(group);
  app.add_option("--max-iterations", command.max_iterations, "srivc: iterations (default: 50)")
      ->type_name("N")
      ->check(CLI::PositiveNumber)
      ->group(group);
  add_repeated(app, "--without", command.without,
               "coefficient that is zero, e.g. b1, or a0 for an integrator; repeatable or separated by commas "
               "(default: none)")
      ->delimiter(',')
      ->type_name("NAME")
      ->group(group);
  CLI::Option* const delay = app.add_option("--delay", command.delay, "delay of the input in samples (default: 0)")
                                 ->type_name("K")
                                 ->check(CLI::NonNegativeNumber)
                                 ->group(group);
  app.add_option("--max-delay", command.max_delay,
                 "longest delay in samples of a search: by the squared error of the simulation, of goodwin and tustin "
                 "that one step ahead (default: none)")
      ->type_name("K")
      ->check(CLI::PositiveNumber)
      ->excludes(delay)
      ->group(group);
  add_file(app, "-o,--save", command.outputs.model, "model file (JSON) that simulates samples");
  add_file(app, "--json", command.outputs.json, "all figures of the result as JSON");
  add_file(app, "--report", command.outputs.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.quiet)->group("Results");
}

void add_response_columns(CLI::App& app, ResponseColumns& columns) {
  const std::string group = "Table of a frequency response (columns named as signals are)";
  CLI::Option* const frequency =
      app.add_option("--frequency", columns.frequency, "frequencies, rising; makes DATA a table")
          ->type_name("NAME")
          ->group(group);
  const auto add = [&](const char* option, std::optional<std::string>& value, const std::string& help) {
    app.add_option(option, value, help)->type_name("NAME")->needs(frequency)->group(group);
  };
  const auto add_unit = [&](const char* option, std::string& value, const std::vector<std::string>& units) {
    app.add_option(option, value, units[0] + " or " + units[1] + " (default: " + units[0] + ")")
        ->type_name("UNIT")
        ->check(CLI::IsMember(units))
        ->needs(frequency)
        ->group(group);
  };
  add_unit("--frequency-unit", columns.frequency_unit, {"hz", "rad/s"});
  add("--response", columns.response, "complex variable of a MAT file");
  add("--real", columns.real, "real part, with --imaginary");
  add("--imaginary", columns.imaginary, "imaginary part");
  add("--magnitude", columns.magnitude, "magnitude as a ratio, with --phase");
  add("--magnitude-db", columns.magnitude_db, "magnitude in dB, with --phase");
  add("--phase", columns.phase, "phase");
  add_unit("--phase-unit", columns.phase_unit, {"deg", "rad"});
  add("--deviation", columns.deviation, "standard deviation of the response as a ratio (default: unknown)");
}

void add_frequency_fit(CLI::App& app, FrfCommand& command) {
  const std::string group = "Model and fit (all frequencies in rad/s)";
  app.add_option("--orders", command.orders, "degrees of numerator and denominator, NB <= NA")
      ->type_name("NB,NA")
      ->delimiter(',')
      ->expected(2)
      ->required()
      ->group(group);
  app.add_option("--basis", command.basis,
                 "functions in which both are expanded: flbf (frequency localising), monomial, chebyshev, laguerre, "
                 "kautz (default: flbf)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"flbf", "monomial", "chebyshev", "laguerre", "kautz"}))
      ->group(group);
  app.add_option("--method", command.method,
                 "ls: equation error, sk: Sanathanan-Koerner, iv: refined instrumental variables, ml: least squares "
                 "of the response (default: ml)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"ls", "sk", "iv", "ml"}))
      ->group(group);
  app.add_option("--weighting", command.weighting,
                 "relative: 1/|G|, none, deviation: 1/standard deviation (default: deviation with --deviation and for "
                 "records that show it with two degrees of freedom or more, otherwise relative)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"relative", "none", "deviation"}))
      ->group(group);
  app.add_option("--break-points", command.break_points,
                 "flbf: break points with equal ratios from LO to HI; there are NA of them (default: over the band of "
                 "the data, of a record where its input has power)")
      ->type_name("LO:HI[:COUNT]")
      ->group(group);
  app.add_flag("--no-relocate", command.no_relocate,
               "flbf: keep the break points even where |A/E| drifts over decades (default: off)")
      ->group(group);
  app.add_option("--point", command.point,
                 "other bases: frequency scale, pole, or frequency and damping ratio of kautz (default: geometric "
                 "mean of the band; chebyshev its end; damping ratio 0.7)")
      ->type_name("W[,ZETA]")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->group(group);
  app.add_option("--band", command.band, "only the tones from LO to HI (default: all)")
      ->type_name("LO:HI")
      ->group(group);
  app.add_option("--max-iterations", command.max_iterations, "iterations of each method (default: 50)")
      ->type_name("N")
      ->check(CLI::PositiveNumber)
      ->group(group);
  app.add_option("--hold", command.hold,
                 "input between samples, of a record (zoh, foh, band_limited) and of the model file (default: "
                 "band_limited)")
      ->type_name("WORD")
      ->group(group);
}

void add_frf(CLI::App& program, FrfCommand& command) {
  CLI::App& app =
      *program.add_subcommand("frf", "continuous-time linear model from a frequency response, given or measured");
  app.footer(kExitCodesText);
  add_data_options(app, command.data, Signals::none, ", of a record or for -o");
  add_response_columns(app, command.columns);
  add_repeated(app, "--train", command.ranges.train,
               "of a record: samples to use, zero-based, half-open; repeatable, each a realisation (default: all)")
      ->type_name("A:B")
      ->group("Data");
  app.add_option("--transient-periods", command.transient_periods,
                 "of a record: periods at the start of each range that are left out; with --period (default: 0)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group("Data");
  add_frequency_fit(app, command);
  add_file(app, "-o,--save", command.outputs.model, "model file (JSON) that simulates samples; needs a sample time");
  add_file(app, "--json", command.outputs.json, "all figures of the result as JSON");
  add_file(app, "--report", command.outputs.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.quiet)->group("Results");
}

void add_linear(CLI::App& program, LinearCommand& command) {
  CLI::App& app = *program.add_subcommand("linear", "discrete-time linear model with a model of the noise");
  app.footer(kExitCodesText);
  add_data_options(app, command.data, Signals::input_and_output, "");
  add_ranges(app, command.ranges);
  app.add_option("--warmup", command.scoring.warmup,
                 "samples at the start of each record that are neither fitted nor scored (default: 0)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group("Scoring");
  app.add_option("--initial-state", command.scoring.initial_state,
                 "what was before each record: estimated (fitted to the record) or zero (rest) (default: estimated)")
      ->type_name("WORD")
      ->check(CLI::IsMember({"zero", "estimated"}))
      ->group("Scoring");
  constexpr int kMostAhead = 1'000'000;
  app.add_option("--ahead", command.ahead,
                 "also score predictions so many samples ahead, beside one step and simulation (default: none)")
      ->type_name("K")
      ->check(CLI::Range(2, kMostAhead))
      ->group("Scoring");
  const std::string group = "Model and fit";
  app.add_option("--structure", command.structure,
                 "arx: A y = B u + e, armax: A y = B u + C e, oe: y = B/F u + e, bj: y = B/F u + C/D e")
      ->type_name("NAME")
      ->check(CLI::IsMember({"arx", "armax", "oe", "bj"}))
      ->required()
      ->group(group);
  add_repeated(app, "--orders", command.orders,
               "degrees of the polynomials and the delay of the input in samples, e.g. nb=1,nf=2,nc=1,nd=1,nk=1; those "
               "that are not named are 0")
      ->delimiter(',')
      ->type_name("KEY=N,...")
      ->required()
      ->group(group);
  app.add_option(
         "--max-iterations", command.max_iterations,
         "Levenberg-Marquardt iterations from each start (default: " + std::to_string(command.max_iterations) + ")")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  add_file(app, "-o,--save", command.model, "model file (JSON) of the path from input to output, for simulate");
  add_file(app, "--json", command.json, "all figures of the result as JSON");
  add_file(app, "--report", command.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.quiet)->group("Results");
}

void add_closed_loop(CLI::App& program, ClosedLoopCommand& command) {
  CLI::App& app = *program.add_subcommand(
      "closed-loop",
      "whether a closed-loop record contradicts a model with bounded uncertainty; exit code 0 not invalidated, 5 "
      "invalidated, 6 undecided");
  app.footer(kExitCodesText);
  app.add_option("DATA", command.files,
                 std::string("data files, one experiment each, with the same signal names: ") + kDataFormats)
      ->required();
  add_signal_options(app, command.data, Signals::input_and_output, "");
  const std::string loop = "Loop (u = r - C y; each a model FILE.json or \"b0,b1,... / a0,a1,...\" in powers of q^-1)";
  app.add_option("--plant", command.plant, "model of the plant")->type_name("SYSTEM")->required()->group(loop);
  app.add_option("--controller", command.controller, "the controller C of the experiment")
      ->type_name("SYSTEM")
      ->required()
      ->group(loop);
  app.add_option("--weight", command.weight, "V, the size of the uncertainty: biproper, stable, minimum phase")
      ->type_name("SYSTEM")
      ->required()
      ->group(loop);
  app.add_option("--factor-pole", command.factor_pole,
                 "where the coprime factors move poles on or outside the unit circle to (default: 0.9)")
      ->type_name("P")
      ->group(loop);
  app.add_option("--reference", command.reference,
                 "signal r, or a gain times it, to check that u = r - C y holds in the record (default: not checked)")
      ->type_name("NAME|GAIN*NAME")
      ->group("Data");
  add_repeated(app, "--range", command.ranges,
               "samples of the experiment, which begins at rest; repeatable: one for each file, or several experiments "
               "of one file (default: all)")
      ->type_name("A:B")
      ->group("Data");
  app.add_option("--rest", command.rest,
                 "samples at the start of the range whose mean is subtracted from each signal (default: 0, none)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group("Data");
  const std::string noise = "Noise";
  CLI::Option* const gamma =
      add_repeated(app, "--gamma", command.gamma,
                   "largest |delta| that the noise leaves in w; repeatable or separated by commas: one for each "
                   "experiment (default: none, w is exact)")
          ->delimiter(',')
          ->type_name("G")
          ->check(CLI::NonNegativeNumber)
          ->group(noise);
  add_repeated(app, "--quiet-run", command.quiet_runs,
               "samples of DATA without a reference, from rest: the noise bound is --safety times the largest |w| "
               "there; repeatable: one for each experiment")
      ->type_name("A:B")
      ->excludes(gamma)
      ->group(noise);
  app.add_option("--safety", command.safety, "factor on the noise of the quiet run (default: 1.2)")
      ->type_name("F")
      ->group(noise);
  const std::string test = "Test";
  CLI::Option* const window =
      app.add_option("--window", command.window,
                     "samples of a window; windows all along the record are judged (default: the record as a whole)")
          ->type_name("N")
          ->check(CLI::PositiveNumber)
          ->group(test);
  app.add_option("--step", command.step, "samples from window to window (default: half a window)")
      ->type_name("N")
      ->check(CLI::PositiveNumber)
      ->needs(window)
      ->group(test);
  app.add_option("--past", command.past,
                 "samples before each window that explain its start (default: as many as --longest allows)")
      ->type_name("L")
      ->check(CLI::NonNegativeNumber)
      ->needs(window)
      ->group(test);
  app.add_option("--memory", command.memory,
                 "samples after which the uncertainty has forgotten its input (default: from the poles of the loop)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group(test);
  app.add_option("--longest", command.longest,
                 "most samples of one test; its time grows with the third power (default: 500)")
      ->type_name("N")
      ->check(CLI::PositiveNumber)
      ->group(test);
  app.add_option("--max-iterations", command.max_iterations,
                 "most iterations of one test; a verdict that needs more is undecided (default: 100)")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->group(test);
  app.add_flag("--curve", command.curve, "uncertainty over noise bound with slopes and elbow (default: off)")
      ->group(test);
  constexpr int kMostBands = 200;
  app.add_option("--bands", command.bands,
                 "frequencies at which lower bounds of the uncertainty are given (default: 0)")
      ->type_name("N")
      ->check(CLI::Range(1, kMostBands))
      ->group(test);
  add_file(app, "--json", command.json, "verdict, evidence and all figures as JSON");
  add_file(app, "--report", command.report, "self-contained HTML report; its pictures need gnuplot");
  add_quiet(app, command.quiet)->group("Results");
}

void add_info(CLI::App& program, InfoCommand& command) {
  CLI::App& app = *program.add_subcommand("info", "what a data file or a model file holds");
  app.footer(kExitCodesText);
  app.add_option("FILE", command.file, "data file (CSV, MAT) or model file (JSON)")->required();
  add_file(app, "--json", command.json, "the same as JSON");
}

void add_demo(CLI::App& program, DemoCommand& command) {
  CLI::App& app = *program.add_subcommand(
      "demo", "identify a built-in synthetic Wiener-Hammerstein system; writes model.json, report.html, result.json");
  app.footer(kExitCodesText);
  app.add_option("--output-dir", command.output_dir,
                 "folder for the results, made if missing (default: the current one)")
      ->type_name("DIR");
  app.add_option("--seed", command.run.seed, "seed of the synthetic data (default: 1)")->type_name("N");
  add_threads(app, command.run);
  add_quiet(app, command.run.quiet);
}

void add_reproduce(CLI::App& program, ReproduceCommand& command) {
  CLI::App& app = *program.add_subcommand(
      "reproduce", "compute the figures of a publication anew and compare; exit code 2 when one is missed");
  app.footer("Exit code 2 means that a published figure was missed.\n" + std::string(kExitCodesText));
  app.add_option("NAME", command.name, "publication, one of --list");
  app.add_flag("--list", command.list, "show the publications and end (default: off)");
  app.add_option("--seed", command.seed, "seed of the simulated data (default: 1)")->type_name("N");
  app.add_option("-o,--output-dir", command.folder,
                 "folder for the pictures as SVG files, made if missing; they need gnuplot (default: not drawn)")
      ->type_name("FOLDER")
      ->group("Results");
  add_file(app, "--json", command.json, "published and reproduced figures, and notes on the print, as JSON");
  add_quiet(app, command.quiet)->group("Results");
}

struct Commands {
  FitCommand fit;
  SimulateCommand simulate;
  ValidateCommand validate;
  BlaCommand bla;
  CtCommand ct;
  FrfCommand frf;
  LinearCommand linear;
  ClosedLoopCommand closed_loop;
  InfoCommand info;
  DemoCommand demo;
  ReproduceCommand reproduce;
};

/// The program's own words for a mistake that the parser would call a missing subcommand.
void check_command_name(const CLI::App& app, int argc, const char* const* argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::string known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name() == argv[1]) return;
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  fail("there is no command '", argv[1], "'; expected ", known);
}

int dispatch(const CLI::App& app, const Commands& commands) {
  const std::string name = app.get_subcommands().front()->get_name();
  if (name == "fit") return run_fit(commands.fit);
  if (name == "simulate") return run_simulate(commands.simulate);
  if (name == "validate") return run_validate(commands.validate);
  if (name == "bla") return run_bla(commands.bla);
  if (name == "ct") return run_ct(commands.ct);
  if (name == "frf") return run_frf(commands.frf);
  if (name == "linear") return run_linear(commands.linear);
  if (name == "closed-loop") return run_closed_loop(commands.closed_loop);
  if (name == "info") return run_info(commands.info);
  if (name == "demo") return run_demo(commands.demo);
  return run_reproduce(commands.reproduce);
}

int run(int argc, const char* const* argv) {
  CLI::App app(kDescription, "blockid");
  app.set_version_flag("--version", "blockid " BLOCKID_VERSION);
  app.require_subcommand(1);
  app.footer(std::string(kExitCodesText) + "blockid COMMAND --help explains a command's options.");
  Commands commands;
  add_fit(app, commands.fit);
  add_simulate(app, commands.simulate);
  add_validate(app, commands.validate);
  add_bla(app, commands.bla);
  add_ct(app, commands.ct);
  add_frf(app, commands.frf);
  add_linear(app, commands.linear);
  add_closed_loop(app, commands.closed_loop);
  add_info(app, commands.info);
  add_demo(app, commands.demo);
  add_reproduce(app, commands.reproduce);
  check_command_name(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kSuccess : kBadInput;
  }
  return dispatch(app, commands);
}

}  // namespace

int run_program(int argc, const char* const* argv) {
  try {
    return run(argc, argv);
  } catch (const OutputError& error) {
    std::cerr << "blockid: " << error.what() << '\n';
    return kCannotWrite;
  } catch (const Error& error) {
    std::cerr << "blockid: " << error.what() << '\n';
    return kBadInput;
  } catch (const std::exception& error) {
    std::cerr << "blockid: internal error: " << error.what() << '\n';
    return kInternalError;
  }
}

}  // namespace blockid::cli
