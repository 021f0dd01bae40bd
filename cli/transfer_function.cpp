#include <blockid/cli/transfer_function.hpp>

#include <blockid/cli/leaf_blocks.hpp>
#include <blockid/cli/text_table.hpp>

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/filtered.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <sstream>
#include <vector>

namespace blockid::cli {
namespace {

using Eigen::VectorXd;

DiscreteTransferFunction product(const DiscreteTransferFunction& a, const DiscreteTransferFunction& b) {
  return {detail::convolved(a.numerator, b.numerator), detail::convolved(a.denominator, b.denominator)};
}

const VectorXd kOne = VectorXd::Ones(1);

DiscreteTransferFunction leaf_system(const LeafBlock& leaf) {
  const std::span<const double> theta(leaf.parameters.data(), static_cast<std::size_t>(leaf.parameters.size()));
  if (const auto* rational = leaf.block.target<Rational>()) {
    return {rational->numerator(theta), rational->denominator(theta)};
  }
  if (leaf.block.target<Fir>() != nullptr || leaf.block.target<Gain>() != nullptr) return {leaf.parameters, kOne};
  if (const auto* delay = leaf.block.target<Delay>()) {
    return {VectorXd::Unit(delay->samples() + 1, delay->samples()), kOne};
  }
  if (const auto* biquads = leaf.block.target<Biquads>()) {
    const Eigen::MatrixXd sections = biquads->second_order_sections(theta);
    DiscreteTransferFunction all{kOne, kOne};
    for (Index k = 0; k < sections.rows(); ++k) {
      all = product(all, {sections.row(k).head(3).transpose(), sections.row(k).tail(3).transpose()});
    }
    return all;
  }
  fail(leaf.path, ": expected a row of gain, delay, fir, rational and biquads, got ", leaf.block.kind());
}

bool has_sum(const AnyBlock& block) {
  if (block.target<Parallel>() != nullptr) return true;
  const auto* const row = block.target<Series>();
  if (row == nullptr) return false;
  const auto& children = row->children();
  return std::any_of(children.begin(), children.end(), [](const auto& child) { return has_sum(child.block); });
}

/// Numbers separated by commas and blanks.
VectorXd coefficients(const std::string& option, const std::string& text) {
  std::string spaced = text;
  for (char& c : spaced) c = c == ',' ? ' ' : c;
  std::istringstream stream(spaced);
  stream.imbue(std::locale::classic());
  std::vector<double> values;
  for (double value = 0.0; stream >> value;) values.push_back(value);
  if (!stream.eof() || values.empty()) {
    fail(option, " ", text, ": expected FILE.json or coefficients of q^-1 as \"b0,b1,... / a0,a1,...\"");
  }
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

bool is_model_name(const std::string& text) { return text.ends_with(".json"); }

std::string polynomial_text(const VectorXd& p) {
  std::string text;
  for (Index k = 0; k < p.size(); ++k) {
    if (p[k] == 0.0 && p.size() > 1) continue;
    text += text.empty() ? (p[k] < 0.0 ? "-" : "") : (p[k] < 0.0 ? " - " : " + ");
    text += number(std::abs(p[k])) + (k == 0 ? "" : k == 1 ? " q^-1" : " q^-" + std::to_string(k));
  }
  return text.empty() ? "0" : text;
}

}  // namespace

DiscreteTransferFunction transfer_function(const Model& model) {
  if (has_sum(model.chain)) fail("expected a row of gain, delay, fir, rational and biquads, got a sum of branches");
  DiscreteTransferFunction all{kOne, kOne};
  for (const LeafBlock& leaf : leaf_blocks(model)) all = product(all, leaf_system(leaf));
  return all;
}

NamedTransferFunction transfer_function(const std::string& option, const std::string& text) {
  if (is_model_name(text)) {
    const Model model = load_model(text);
    try {
      return {transfer_function(model), model.sample_time_s};
    } catch (const Error& error) {
      fail(option, " ", text, ": ", error.what());
    }
  }
  const std::size_t slash = text.find('/');
  NamedTransferFunction result;
  result.system.numerator = coefficients(option, text.substr(0, slash));
  result.system.denominator = slash == std::string::npos ? kOne : coefficients(option, text.substr(slash + 1));
  if (result.system.denominator[0] == 0.0) fail(option, " ", text, ": expected a0 other than 0");
  return result;
}

std::string to_text(const DiscreteTransferFunction& g) {
  if (g.denominator.size() == 1 && g.denominator[0] == 1.0) return polynomial_text(g.numerator);
  return "(" + polynomial_text(g.numerator) + ") / (" + polynomial_text(g.denominator) + ")";
}

std::complex<double> response(const DiscreteTransferFunction& g, double omega) {
  const auto value = [&](const VectorXd& p) {
    std::complex<double> sum = 0.0;
    for (Index k = 0; k < p.size(); ++k) sum += p[k] * std::polar(1.0, -omega * static_cast<double>(k));
    return sum;
  };
  return value(g.numerator) / value(g.denominator);
}

double magnitude(const DiscreteTransferFunction& g, double omega) { return std::abs(response(g, omega)); }

}  // namespace blockid::cli
