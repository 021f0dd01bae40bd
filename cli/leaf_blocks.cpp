#include <blockid/cli/leaf_blocks.hpp>

#include <blockid/blocks/biquads.hpp>
#include <blockid/blocks/detail/children.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/init/root_groups.hpp>

#include <cmath>
#include <numbers>
#include <utility>

namespace blockid::cli {
namespace {

using detail::child_name;
using detail::view;

/// Depth first over the leaves below `block`; `signal` is the block's input on entry and its output on exit when it is
/// not empty, and `state` the block's.
struct Walk {
  std::vector<LeafBlock> leaves;
  std::vector<Eigen::VectorXd> inputs;

  void visit(const AnyBlock& block, const std::string& path, Index offset, const Eigen::VectorXd& theta,
             const Eigen::VectorXd& state, Eigen::VectorXd& signal) {
    const std::vector<LabelledBlock> children = block.children();
    if (children.empty()) {
      leaves.push_back({path, block, offset, theta});
      inputs.push_back(signal);
      run(block, theta, state, signal);
      return;
    }
    const bool is_row = block.target<Series>() != nullptr;
    const Eigen::VectorXd input = signal;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(input.size());
    Index parameter = 0;
    Index number = 0;
    for (std::size_t k = 0; k < children.size(); ++k) {
      const AnyBlock& child = children[k].block;
      if (!is_row) signal = input;
      const std::string name = child_name(children, k);
      visit(child, path.empty() ? name : path + "." + name, offset + parameter,
            theta.segment(parameter, child.parameter_count()), state.segment(number, child.state_count()), signal);
      parameter += child.parameter_count();
      number += child.state_count();
      sum += signal;
    }
    if (!is_row) signal = sum;
  }

 private:
  static void run(const AnyBlock& block, const Eigen::VectorXd& theta, Eigen::VectorXd state, Eigen::VectorXd& signal) {
    if (signal.size() == 0) return;
    Eigen::VectorXd output(signal.size());
    block.apply(view(theta), view(state), view(signal), view(output));
    signal = std::move(output);
  }
};

Walk walk(const Model& model, Eigen::VectorXd signal) {
  const Eigen::VectorXd state =
      model.initial_state.size() > 0 ? model.initial_state : Eigen::VectorXd::Zero(model.chain.state_count());
  Walk result;
  result.visit(model.chain, "", 0, model.parameters, state, signal);
  return result;
}

/// Roots z of p_0 z^n + ... + p_n; those at the origin left out.
std::vector<std::complex<double>> roots_of(const Eigen::VectorXd& polynomial) {
  if (polynomial.size() == 0 || polynomial.isZero(0.0)) return {};
  std::vector<std::complex<double>> result;
  for (const std::complex<double>& root : roots(root_groups(polynomial))) {
    if (std::abs(root) > 0.0) result.push_back(root);
  }
  return result;
}

void append(std::vector<std::complex<double>>& to, const std::vector<std::complex<double>>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

std::vector<LeafBlock> leaf_blocks(const Model& model) { return walk(model, Eigen::VectorXd()).leaves; }

std::vector<Eigen::VectorXd> leaf_inputs(const Model& model, const Eigen::VectorXd& u) { return walk(model, u).inputs; }

std::optional<LinearRoots> linear_roots(const AnyBlock& block, const Eigen::VectorXd& parameters) {
  if (!parameters.allFinite()) return std::nullopt;
  if (const auto* rational = block.target<Rational>()) {
    const Eigen::VectorXd b = parameters.head(rational->nb() + 1);
    if (b.isZero(0.0)) return std::nullopt;
    return LinearRoots{roots_of(b), roots_of(rational->denominator(view(parameters)))};
  }
  if (const auto* fir = block.target<Fir>()) {
    const Eigen::VectorXd b = parameters.head(fir->nb() + 1);
    if (b.isZero(0.0)) return std::nullopt;
    return LinearRoots{roots_of(b), {}};
  }
  if (const auto* biquads = block.target<Biquads>()) {
    const Eigen::MatrixXd sections = biquads->second_order_sections(view(parameters));
    LinearRoots result;
    for (Index k = 0; k < sections.rows(); ++k) {
      append(result.zeros, roots_of(sections.row(k).head(3).transpose()));
      append(result.poles, roots_of(sections.row(k).tail(3).transpose()));
    }
    return result;
  }
  return std::nullopt;
}

double natural_frequency_hz(std::complex<double> root, double sample_time_s) {
  return std::abs(std::log(root)) / (2.0 * std::numbers::pi * sample_time_s);
}

std::optional<double> dc_gain(const AnyBlock& block, const Eigen::VectorXd& parameters) {
  const std::optional<std::complex<double>> gain = block.frequency_response(view(parameters), 0.0);
  if (!gain) return std::nullopt;
  return gain->real();
}

std::string to_text(std::complex<double> root) {
  constexpr int kDigits = 5;
  if (root.imag() == 0.0) return number(root.real(), kDigits);
  return number(root.real(), kDigits) + (root.imag() < 0.0 ? "-" : "+") + number(std::abs(root.imag()), kDigits) + "i";
}

}  // namespace blockid::cli
