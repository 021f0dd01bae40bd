// The methods of `blockid ct` on random continuous-time systems: how often the model found is a bad one, and what it
// costs. Every method sees the same records.
//
// A system of order n has n / 2 pairs of poles and n - 1 zeros. Frequencies are drawn log-uniformly from 0.005 to 0.25
// of the Nyquist frequency, damping ratios from 0.05 to 1; one zero is real; each zero or pair lies in the right half
// plane with probability 0.3. Its input, white or through 1 / (1 - 0.9 q^-1), is held between the samples, the system
// starts from rest, white noise is added to the output. The error of a model is that of its simulation against the
// output without noise, over the record; a model is bad when it is more than twice that of a refit of the output error
// that is started at the true system.

#include <blockid/cli/ct_outcome.hpp>
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/continuous_fit.hpp>
#include <blockid/estimators/continuous_refit.hpp>
#include <blockid/estimators/detail/parallel_for.hpp>
#include <blockid/problems/gaussian.hpp>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <ctime>
#include <exception>
#include <iostream>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

using namespace blockid;
using Eigen::VectorXd;
using Json = nlohmann::ordered_json;

constexpr double kBad = 2.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Settings {
  std::vector<Index> orders = {2, 4, 6};
  std::vector<double> snr_db = {40.0, 20.0, 5.0};
  /// Systems of each order, ratio and kind of input.
  int systems = 2;
  Index samples = 5000;
  std::uint64_t seed = 1;
  int threads = 1;
  std::string json;
};

struct Method {
  std::string name;
  std::string estimator;
  bool iv = false;
  bool refit = false;
};

const std::vector<Method>& methods() {
  static const std::vector<Method> kMethods = {{"srivc", "srivc"},
                                               {"srivc --refit", "srivc", false, true},
                                               {"flbf", "flbf"},
                                               {"flbf --iv", "flbf", true},
                                               {"flbf --refit", "flbf", false, true},
                                               {"svf", "svf"},
                                               {"svf --iv", "svf", true},
                                               {"svf --refit", "svf", false, true},
                                               {"tustin", "tustin"},
                                               {"tustin --refit", "tustin", false, true}};
  return kMethods;
}

// ---------------------------------------------------------------------------------------------------------- systems

/// Uniform in (0, 1), from the distribution function of a Gaussian number.
double uniform(problems::Gaussian& numbers) { return 0.5 * std::erfc(-numbers() / std::numbers::sqrt2); }

double log_uniform(problems::Gaussian& numbers, double low, double high) {
  return low * std::pow(high / low, uniform(numbers));
}

/// Ascending coefficients of the product.
VectorXd times(const VectorXd& p, const VectorXd& q) {
  VectorXd result = VectorXd::Zero(p.size() + q.size() - 1);
  for (Index k = 0; k < q.size(); ++k) result.segment(k, p.size()) += q[k] * p;
  return result;
}

constexpr double kLowest = 0.005 * std::numbers::pi;
constexpr double kHighest = 0.25 * std::numbers::pi;
constexpr double kLeastDamping = 0.05;

/// z^2 + 2 zeta w z + w^2 with w in units of `scale`.
VectorXd random_pair(problems::Gaussian& numbers, double scale) {
  const double omega = log_uniform(numbers, kLowest, kHighest) / scale;
  const double damping = log_uniform(numbers, kLeastDamping, 1.0);
  return Eigen::Vector3d(omega * omega, 2.0 * damping * omega, 1.0);
}

double random_side(problems::Gaussian& numbers) {
  constexpr double kRightHalfPlane = 0.3;
  return uniform(numbers) < kRightHalfPlane ? -1.0 : 1.0;
}

/// Sample time 1 s, of gain one at low frequencies.
ContinuousTransferFunction random_system(problems::Gaussian& numbers, Index order) {
  const double scale = std::sqrt(kLowest * kHighest);
  VectorXd a = VectorXd::Ones(1);
  VectorXd b = VectorXd::Ones(1);
  for (Index k = 0; k < order / 2; ++k) a = times(a, random_pair(numbers, scale));
  for (Index k = 0; k + 1 < order / 2; ++k) {
    VectorXd pair = random_pair(numbers, scale);
    pair[1] *= random_side(numbers);
    b = times(b, pair);
  }
  const double zero = log_uniform(numbers, kLowest, kHighest) / scale;
  b = times(b, Eigen::Vector2d(zero, random_side(numbers)));
  b *= a[0] / b[0];
  return {monomial_basis(order, order - 1, scale), a.head(order), b};
}

VectorXd random_input(problems::Gaussian& numbers, Index samples, bool coloured) {
  constexpr double kPole = 0.9;
  VectorXd u = numbers.vector(samples);
  for (Index t = 1; coloured && t < samples; ++t) u[t] += kPole * u[t - 1];
  return u;
}

struct Case {
  Index order = 0;
  double snr_db = 0.0;
  bool coloured = false;
  std::uint64_t seed = 0;
};

/// A system with its record, and its output without noise.
struct Experiment {
  ContinuousTransferFunction system;
  Record record;
  VectorXd clean;
};

VectorXd simulated(const ContinuousTransferFunction& model, const Record& record) {
  return simulate(model, record, {.hold = Hold::zero_order, .initial_state = InitialState::zero});
}

Experiment experiment_of(const Case& one, Index samples) {
  problems::Gaussian numbers(one.seed);
  constexpr double kDecibels = 20.0;
  Experiment result;
  result.system = random_system(numbers, one.order);
  result.record.u = random_input(numbers, samples, one.coloured);
  result.record.y = VectorXd::Zero(samples);
  result.clean = simulated(result.system, result.record);
  const double rms = std::sqrt(result.clean.squaredNorm() / static_cast<double>(samples));
  result.record.y = result.clean + rms * std::pow(10.0, -one.snr_db / kDecibels) * numbers.vector(samples);
  return result;
}

// ------------------------------------------------------------------------------------------------------------- fits

struct Outcome {
  double error = kInfinity;
  bool stable = true;
  /// The program would have warned of something.
  bool warned = false;
  double seconds = 0.0;
};

double thread_seconds() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double error_of(const ContinuousTransferFunction& model, const Experiment& experiment) {
  const double error = (simulated(model, experiment.record) - experiment.clean).norm() / experiment.clean.norm();
  return std::isfinite(error) ? error : kInfinity;
}

/// As the program does it: filters with estimated initial states, trends from rest.
cli::CtEstimate estimated(const Method& method, const DataSet& data, Index order) {
  const bool trends = method.estimator == "tustin";
  const PredictionOptions prediction{.initial_state = trends ? InitialState::zero : InitialState::estimated};
  if (trends) {
    cli::CtEstimate estimate = cli::estimate_of(fit_trends(data, full_trends(TrendScheme::tustin, order - 1, order)));
    if (method.refit) cli::refit_estimate(estimate, data, prediction);
    return estimate;
  }
  cli::CtCommand command;
  command.method = method.estimator;
  command.orders = {static_cast<int>(order) - 1, static_cast<int>(order)};
  command.hold = "zoh";
  command.iv = method.iv;
  command.refit = method.refit;
  return cli::continuous_estimate(command, data, prediction);
}

Outcome outcome_of(const Method& method, const Experiment& experiment) {
  const DataSet data{{experiment.record}};
  Outcome outcome;
  const double begin = thread_seconds();
  try {
    const cli::CtEstimate estimate = estimated(method, data, experiment.system.basis.order);
    outcome.seconds = thread_seconds() - begin;
    outcome.error = error_of(estimate.transfer_function, experiment);
    outcome.stable = is_stable(estimate.transfer_function);
    outcome.warned = !estimate.warnings.empty();
  } catch (const Error&) {
    outcome.seconds = thread_seconds() - begin;  // refused: a bad fit
    outcome.warned = true;
  }
  return outcome;
}

double error_from_truth(const Experiment& experiment) {
  RefitOptions options;
  options.prediction.initial_state = InitialState::estimated;
  const ContinuousRefit refined = refit(experiment.system, {{experiment.record}}, Hold::zero_order, options);
  return error_of(refined.transfer_function, experiment);
}

struct CaseOutcome {
  double truth = 0.0;
  std::vector<Outcome> fits;
};

std::vector<Case> cases_of(const Settings& settings) {
  std::vector<Case> cases;
  std::uint64_t seed = settings.seed;
  constexpr std::uint64_t kNext = 1'000'003;
  for (const Index order : settings.orders) {
    for (const double snr_db : settings.snr_db) {
      for (const bool coloured : {false, true}) {
        for (int k = 0; k < settings.systems; ++k) cases.push_back({order, snr_db, coloured, kNext * seed++});
      }
    }
  }
  return cases;
}

// ----------------------------------------------------------------------------------------------------------- tables

/// Of the cases that are counted.
struct Summary {
  int cases = 0;
  int bad = 0;
  int bad_without_warning = 0;
  int unstable = 0;
  double median_ratio = 0.0;
  double median_seconds = 0.0;
};

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class Counts>
Summary summary_of(const std::vector<Case>& cases, const std::vector<CaseOutcome>& outcomes, std::size_t method,
                   Counts counts) {
  Summary summary;
  std::vector<double> ratios;
  std::vector<double> seconds;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    if (!counts(cases[k])) continue;
    const Outcome& fit = outcomes[k].fits[method];
    ratios.push_back(fit.error / outcomes[k].truth);
    seconds.push_back(fit.seconds);
    ++summary.cases;
    const bool bad = !(ratios.back() <= kBad);
    summary.bad += bad ? 1 : 0;
    summary.bad_without_warning += bad && !fit.warned ? 1 : 0;
    summary.unstable += fit.stable ? 0 : 1;
  }
  summary.median_ratio = median(ratios);
  summary.median_seconds = median(seconds);
  return summary;
}

void print_tables(const Settings& settings, const std::vector<Case>& cases, const std::vector<CaseOutcome>& outcomes) {
  std::cout << "bad fits of " << cases.size() << ", error more than " << kBad
            << " times that of a refit from the truth\n\n"
            << "| method | bad | without a warning | unstable | median ratio | median time |";
  for (const double snr_db : settings.snr_db) std::cout << " bad at " << snr_db << " dB |";
  for (const Index order : settings.orders) std::cout << " bad of order " << order << " |";
  std::cout << "\n|---|---|---|---|---|---|";
  for (std::size_t k = 0; k < settings.snr_db.size() + settings.orders.size(); ++k) std::cout << "---|";
  std::cout << '\n';
  for (std::size_t m = 0; m < methods().size(); ++m) {
    const Summary all = summary_of(cases, outcomes, m, [](const Case&) { return true; });
    std::cout << "| " << methods()[m].name << " | " << all.bad << " | " << all.bad_without_warning << " | "
              << all.unstable << " | " << cli::number(all.median_ratio, 3) << " | "
              << cli::number(1e3 * all.median_seconds, 3) << " ms |";
    for (const double snr_db : settings.snr_db) {
      std::cout << ' ' << summary_of(cases, outcomes, m, [&](const Case& c) { return c.snr_db == snr_db; }).bad << " |";
    }
    for (const Index order : settings.orders) {
      std::cout << ' ' << summary_of(cases, outcomes, m, [&](const Case& c) { return c.order == order; }).bad << " |";
    }
    std::cout << '\n';
  }
}

Json json_of(const std::vector<Case>& cases, const std::vector<CaseOutcome>& outcomes) {
  Json list = Json::array();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    Json one = {{"order", cases[k].order},
                {"snr_db", cases[k].snr_db},
                {"coloured", cases[k].coloured},
                {"seed", cases[k].seed},
                {"truth", outcomes[k].truth}};
    for (std::size_t m = 0; m < methods().size(); ++m) {
      const Outcome& fit = outcomes[k].fits[m];
      one["fits"][methods()[m].name] = {{"error", std::isfinite(fit.error) ? Json(fit.error) : Json(nullptr)},
                                        {"stable", fit.stable},
                                        {"seconds", fit.seconds}};
    }
    list.push_back(std::move(one));
  }
  return list;
}

int run(const Settings& settings) {
  const std::vector<Case> cases = cases_of(settings);
  std::vector<CaseOutcome> outcomes(cases.size());
  detail::parallel_for(cases.size(), settings.threads, [&](std::size_t k) {
    const Experiment experiment = experiment_of(cases[k], settings.samples);
    outcomes[k].truth = error_from_truth(experiment);
    for (const Method& method : methods()) outcomes[k].fits.push_back(outcome_of(method, experiment));
  });
  print_tables(settings, cases, outcomes);
  if (!settings.json.empty()) cli::write_output(settings.json, cli::json_text(json_of(cases, outcomes)));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  CLI::App app("The methods of `blockid ct` on random systems: share of bad fits, and time");
  app.add_option("--orders", settings.orders, "even orders")->delimiter(',')->check(CLI::PositiveNumber);
  app.add_option("--snr", settings.snr_db, "signal to noise ratios, dB")->delimiter(',');
  app.add_option("--systems", settings.systems, "systems of each order, ratio and kind of input")
      ->check(CLI::PositiveNumber);
  app.add_option("--samples", settings.samples, "samples of a record")->check(CLI::PositiveNumber);
  app.add_option("--seed", settings.seed, "of the first system; the others follow");
  app.add_option("--threads", settings.threads, "systems side by side")->check(CLI::PositiveNumber);
  app.add_option("--json", settings.json, "all errors as JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(settings);
  } catch (const std::exception& error) {
    std::cerr << "ct_methods: " << error.what() << '\n';
    return 1;
  }
}
