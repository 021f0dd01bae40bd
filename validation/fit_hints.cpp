#include <blockid/validation/fit_hints.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/tail_probability.hpp>

#include <algorithm>
#include <cmath>

namespace blockid {
namespace {

using Eigen::Index;
using Root = std::complex<double>;

bool lower_half(const CancellingPair& pair) { return pair.pole.imag() < 0.0 || pair.zero.imag() < 0.0; }

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string root_text(const Root& root) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  constexpr int kDigits = 4;
  text.precision(kDigits);
  text << root.real();
  if (root.imag() != 0.0) text << (root.imag() < 0.0 ? "-" : "+") << std::abs(root.imag()) << 'i';
  return text.str();
}

/// With three digits.
std::string short_number(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(3);
  text << value;
  return text.str();
}

/// Parameters whose standard deviation exceeds their value.
std::vector<std::string> uncertain_parameters(const Model& model) {
  std::vector<std::string> names;
  if (model.standard_deviations.size() != model.parameters.size()) return names;
  const std::vector<std::string> all = model.chain.parameter_names();
  for (Index k = 0; k < model.parameters.size(); ++k) {
    if (model.standard_deviations[k] > std::abs(model.parameters[k])) names.push_back(all[static_cast<std::size_t>(k)]);
  }
  return names;
}

void add_pairs(std::vector<std::string>& hints, const FilterRoots& filter) {
  for (const CancellingPair& pair : cancelling_pairs(filter)) {
    hints.push_back(filter.name + ": the zero " + root_text(pair.zero) + " and the pole " + root_text(pair.pole) +
                    " nearly cancel; without them the response changes by at most " +
                    short_number(100.0 * pair.change) + " %: lower orders may do");
  }
}

bool contains(const std::vector<Root>& roots, const Root& root) {
  return std::any_of(roots.begin(), roots.end(), [&](const Root& other) { return std::abs(other - root) < 1e-9; });
}

/// Whether a pair of roots that nearly cancel anyway says the same.
bool is_said(const CommonFactor& common, const std::vector<CancellingPair>& pairs) {
  return std::any_of(pairs.begin(), pairs.end(), [&](const CancellingPair& pair) {
    return contains(common.zeros, pair.zero) && contains(common.poles, pair.pole);
  });
}

std::string list_text(const char* one, const std::vector<Root>& roots) {
  if (roots.size() == 1) return std::string("the ") + one + " " + root_text(roots[0]);
  return std::string("the ") + one + "s " + root_text(roots[0]) + " and " + root_text(roots[1]);
}

void add_common_factors(std::vector<std::string>& hints, const EstimatedFilter& filter,
                        const std::vector<FilterRoots>& all) {
  std::vector<CancellingPair> pairs;
  for (const FilterRoots& roots : all) {
    if (roots.name == filter.name) pairs = cancelling_pairs(roots);
  }
  for (const CommonFactor& common : common_factors(filter)) {
    if (is_said(common, pairs)) continue;
    const auto less = static_cast<Index>(common.zeros.size());
    hints.push_back(filter.name + ": the data do not tell " + list_text("zero", common.zeros) + " from " +
                    list_text("pole", common.poles) + " (p = " + short_number(common.p_value) +
                    "): nb=" + std::to_string(filter.numerator.size() - 1 - less) +
                    " and na=" + std::to_string(filter.denominator.size() - 1 - less) + " may do");
  }
  const std::vector<std::string> vanishing = vanishing_coefficients(filter);
  if (!vanishing.empty()) {
    hints.push_back(filter.name + ": within two standard deviations of zero: " + joined(vanishing) +
                    "; a lower degree may do");
  }
}

}  // namespace

std::vector<CancellingPair> cancelling_pairs(const FilterRoots& roots, double largest_change) {
  std::vector<CancellingPair> all;
  for (const Root& pole : roots.poles) {
    for (const Root& zero : roots.zeros) {
      const double change = std::abs(pole - zero) / (1.0 - std::abs(pole));
      if (std::abs(pole) < 1.0 && change < largest_change) all.push_back({zero, pole, change});
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const CancellingPair& a, const CancellingPair& b) { return a.change < b.change; });
  std::vector<CancellingPair> kept;
  for (const CancellingPair& pair : all) {
    const bool used = std::any_of(kept.begin(), kept.end(), [&](const CancellingPair& other) {
      return other.pole == pair.pole || other.zero == pair.zero;
    });
    if (!used) kept.push_back(pair);
  }
  std::erase_if(kept, lower_half);
  return kept;
}

ErrorComparison compare_errors(const ResidualTests& training, const ResidualTests& test) {
  const double n = static_cast<double>(training.samples);
  const double parameters = static_cast<double>(training.rank);
  ErrorComparison result;
  const double explained = parameters / n;
  // The deviation of the training data has its degrees of freedom; what fitting took away is put back.
  const double of_training = training.deviation * std::sqrt(1.0 - explained);
  result.ratio = test.deviation / of_training;
  result.expected = std::sqrt((1.0 + explained) / (1.0 - explained));
  const double variance =
      2.0 / effective_samples(training.noise, training.samples) + 2.0 / effective_samples(test.noise, test.samples);
  result.p_value = normal_tail(2.0 * std::log(result.ratio / result.expected) / std::sqrt(variance));
  return result;
}

std::vector<std::string> over_fit_hints(const OverFitEvidence& evidence) {
  std::vector<std::string> hints;
  if (!evidence.undetermined.empty()) {
    hints.push_back("the data do not determine all parameters; in doubt are " + joined(evidence.undetermined));
  }
  const std::vector<std::string> uncertain = uncertain_parameters(evidence.model);
  if (!uncertain.empty()) hints.push_back("standard deviation above the value: " + joined(uncertain));
  for (const FilterRoots& filter : evidence.filters) add_pairs(hints, filter);
  for (const EstimatedFilter& filter : evidence.estimated) add_common_factors(hints, filter, evidence.filters);
  if (evidence.training != nullptr && evidence.test != nullptr) {
    const ErrorComparison errors = compare_errors(*evidence.training, *evidence.test);
    // A difference that is certain but small is no sign of too many parameters.
    constexpr double kNotable = 1.05;
    if (errors.p_value < evidence.test->significance && errors.ratio > kNotable * errors.expected) {
      hints.push_back("the test error is " + short_number(errors.ratio) + " times the training error, where " +
                      short_number(errors.expected) +
                      " times is what the number of parameters explains: too many parameters, or data of another kind");
    }
  }
  return hints;
}

std::vector<std::string> under_fit_hints(const ResidualTests& tests) {
  std::vector<std::string> hints;
  for (const ResidualTest& test : tests.tests) {
    if (!test.passed) hints.push_back(to_text(test.kind) + ": " + explanation(test));
  }
  return hints;
}

}  // namespace blockid
