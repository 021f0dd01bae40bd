#include <blockid/blocks/model.hpp>

#include <blockid/blocks/detail/children.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/tied.hpp>
#include <blockid/data/error.hpp>

#include <cmath>
#include <utility>
#include <vector>

namespace blockid {
namespace {

using detail::view;

Eigen::VectorXd first_state(const Model& model) {
  return model.initial_state.size() > 0 ? model.initial_state : Eigen::VectorXd::Zero(model.chain.state_count());
}

Eigen::VectorXd run(const AnyBlock& block, std::span<const double> theta, std::span<double> x,
                    const Eigen::VectorXd& u) {
  Eigen::VectorXd y(u.size());
  block.apply(theta, x, view(u), view(y));
  return y;
}

/// Zeros behind the input push the last outputs out of a chain that lags by its latency.
Eigen::VectorXd extended(const Eigen::VectorXd& u, Index samples) {
  Eigen::VectorXd longer = Eigen::VectorXd::Zero(u.size() + samples);
  longer.head(u.size()) = u;
  return longer;
}

Eigen::VectorXd run_from_rest(const Rescaled& block, const Eigen::VectorXd& u) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(block.block.state_count());
  return run(block.block, view(block.parameters), view(x), u);
}

/// The block with every range and knot below it placed for `signal`, and its parameters; `settled` turns false where
/// they start anew. `signal` becomes the output.
Rescaled adapted(const AnyBlock& block, const Eigen::VectorXd& theta, Eigen::VectorXd& signal, bool& settled) {
  if (const auto* tied = block.target<Tied>()) {
    const Rescaled placed = adapted(tied->inner(), tied->inner_parameters(view(theta)), signal, settled);
    const Tied again(placed.block, tied->ties());
    return {again, again.from_inner(view(placed.parameters))};
  }
  if (const auto* oversampled = block.target<Oversampled>()) {
    Eigen::VectorXd fine = oversampled->interpolated(view(signal));
    Rescaled inner = adapted(oversampled->inner(), theta, fine, settled);
    Rescaled placed{oversampled->around(std::move(inner.block)), std::move(inner.parameters)};
    signal = run_from_rest(placed, signal);
    return placed;
  }
  const bool is_row = block.target<Series>() != nullptr;
  if (!is_row && block.target<Parallel>() == nullptr) {
    AnyBlock placed = block.adapted_to(view(signal));
    const bool same = placed.parameter_count() == block.parameter_count() && placed.arguments() == block.arguments();
    settled = settled && same;
    Eigen::VectorXd numbers = same ? theta : placed.initial_parameters();
    Rescaled result{std::move(placed), std::move(numbers)};
    signal = run_from_rest(result, signal);
    return result;
  }
  const Eigen::VectorXd input = signal;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(input.size());
  std::vector<LabelledBlock> children;
  std::vector<double> all;
  Index offset = 0;
  for (const LabelledBlock& child : block.children()) {
    const Index count = child.block.parameter_count();
    if (!is_row) signal = input;
    Rescaled placed = adapted(child.block, theta.segment(offset, count), signal, settled);
    offset += count;
    sum += signal;
    all.insert(all.end(), placed.parameters.begin(), placed.parameters.end());
    children.push_back({child.label, std::move(placed.block)});
  }
  const Eigen::VectorXd numbers = Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Index>(all.size()));
  if (is_row) return {Series(std::move(children)), numbers};
  signal = sum;
  return {Parallel(std::move(children)), numbers};
}

}  // namespace

Model make_model(AnyBlock chain, double sample_time_s) {
  Eigen::VectorXd theta = chain.initial_parameters();
  return {.chain = std::move(chain), .parameters = std::move(theta), .sample_time_s = sample_time_s};
}

void check(const Model& model) {
  const Index expected = model.chain.parameter_count();
  if (model.parameters.size() != expected) {
    fail("model: the chain has ", expected, " parameters, got ", model.parameters.size());
  }
  if (model.initial_state.size() != 0 && model.initial_state.size() != model.chain.state_count()) {
    fail("model: the chain has ", model.chain.state_count(), " states, got an initial state of ",
         model.initial_state.size());
  }
  if (model.standard_deviations.size() != 0 && model.standard_deviations.size() != expected) {
    fail("model: the chain has ", expected, " parameters, got ", model.standard_deviations.size(),
         " standard deviations");
  }
  if (!(model.sample_time_s > 0.0) || !std::isfinite(model.sample_time_s)) {
    fail("model: sample time must be positive, got ", model.sample_time_s, " s");
  }
  for (Index k = 0; k < expected; ++k) {
    if (!std::isfinite(model.parameters[k])) {
      fail("model: parameter ", model.chain.parameter_names()[static_cast<std::size_t>(k)], " is not finite");
    }
  }
  if (!model.initial_state.allFinite()) fail("model: the initial state is not finite");
}

Eigen::VectorXd simulate(const Model& model, const Eigen::VectorXd& u) {
  check(model);
  const Index latency = model.chain.latency();
  Eigen::VectorXd x = first_state(model);
  if (latency == 0) return run(model.chain, view(model.parameters), view(x), u);
  return run(model.chain, view(model.parameters), view(x), extended(u, latency)).tail(u.size());
}

std::vector<Eigen::VectorXd> simulate_signals(const Model& model, const Eigen::VectorXd& u) {
  check(model);
  Eigen::VectorXd x = first_state(model);
  // Each signal is taken as late as the blocks before it lag; the run goes on until the last one is complete.
  Eigen::VectorXd running = extended(u, model.chain.latency());
  std::vector<Eigen::VectorXd> signals = {u};
  Index state_offset = 0;
  Index latency = 0;
  for (const ChildParameters& child : top_level_blocks(model)) {
    const Index states = child.block.state_count();
    running = run(child.block, view(child.parameters), detail::part(view(x), state_offset, states), running);
    latency += child.block.latency();
    signals.emplace_back(running.segment(latency, u.size()));
    state_offset += states;
  }
  return signals;
}

Model adapt_structure(const Model& model, const Eigen::VectorXd& u) {
  check(model);
  Eigen::VectorXd signal = u;
  bool settled = true;
  Rescaled placed = adapted(model.chain, model.parameters, signal, settled);
  Model result = model;
  result.chain = std::move(placed.block);
  result.parameters = std::move(placed.parameters);
  if (!settled) result.standard_deviations.resize(0);
  return result;
}

Simulator::Simulator(Model model) : model_(std::move(model)) {
  check(model_);
  reset();
}

void Simulator::push(std::span<const double> u, std::span<double> yhat) {
  if (u.size() != yhat.size()) fail("simulator: got ", u.size(), " inputs and room for ", yhat.size(), " outputs");
  model_.chain.apply(view(model_.parameters), view(state_), u, yhat);
}

double Simulator::step(double u) {
  double yhat = 0.0;
  push({&u, 1}, {&yhat, 1});
  return yhat;
}

void Simulator::reset() { state_ = first_state(model_); }

Index parameter_index(const Model& model, std::string_view name) {
  const std::vector<std::string> names = model.chain.parameter_names();
  std::string known;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k] == name) return static_cast<Index>(k);
    known += (k > 0 ? ", " : "") + names[k];
  }
  fail("model: there is no parameter '", name, "'; it has ", known);
}

std::vector<ChildParameters> top_level_blocks(const Model& model) {
  if (const auto* series = model.chain.target<Series>()) {
    std::vector<ChildParameters> result;
    for (std::size_t k = 0; k < series->children().size(); ++k) {
      const LabelledBlock& child = series->children()[k];
      const Index offset = series->parameter_offset(static_cast<Index>(k));
      result.push_back(
          {child.label, child.block, offset, model.parameters.segment(offset, child.block.parameter_count())});
    }
    return result;
  }
  return {{"", model.chain, 0, model.parameters}};
}

}  // namespace blockid
