#include <blockid/blocks/model.hpp>

#include <blockid/blocks/detail/children.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>

#include <cmath>

namespace blockid {
namespace {

std::span<const double> view(const Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }
std::span<double> view(Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

Eigen::VectorXd first_state(const Model& model) {
  return model.initial_state.size() > 0 ? model.initial_state : Eigen::VectorXd::Zero(model.chain.state_count());
}

/// Zeros behind the input push the last outputs out of a chain that lags by its latency.
Eigen::VectorXd run(const AnyBlock& block, std::span<const double> theta, std::span<double> x,
                    const Eigen::VectorXd& u) {
  Eigen::VectorXd y(u.size());
  block.apply(theta, x, view(u), view(y));
  return y;
}

Eigen::VectorXd extended(const Eigen::VectorXd& u, Index samples) {
  Eigen::VectorXd longer = Eigen::VectorXd::Zero(u.size() + samples);
  longer.head(u.size()) = u;
  return longer;
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
  std::vector<Eigen::VectorXd> signals = {u};
  Index state_offset = 0;
  for (const ChildParameters& child : top_level_blocks(model)) {
    const Index states = child.block.state_count();
    const Index latency = child.block.latency();
    const Eigen::VectorXd output = run(child.block, view(child.parameters),
                                       detail::part(view(x), state_offset, states), extended(signals.back(), latency));
    signals.push_back(output.tail(u.size()));
    state_offset += states;
  }
  return signals;
}

Model adapt_structure(const Model& model, const Eigen::VectorXd& u) {
  check(model);
  const auto* series = model.chain.target<Series>();
  if (series == nullptr) {
    Model adapted = model;
    adapted.chain = model.chain.adapted_to(view(u));
    if (adapted.chain.arguments() != model.chain.arguments()) {
      adapted.parameters = adapted.chain.initial_parameters();
      adapted.standard_deviations.resize(0);
    }
    return adapted;
  }
  std::vector<LabelledBlock> blocks;
  std::vector<double> theta;
  Eigen::VectorXd signal = u;
  for (const ChildParameters& child : top_level_blocks(model)) {
    const AnyBlock block = child.block.adapted_to(view(signal));
    const bool same = block.parameter_count() == child.block.parameter_count() &&
                      block.arguments() == child.block.arguments();
    const Eigen::VectorXd numbers = same ? child.parameters : block.initial_parameters();
    theta.insert(theta.end(), numbers.begin(), numbers.end());
    Eigen::VectorXd x = Eigen::VectorXd::Zero(block.state_count());
    signal = run(block, view(numbers), view(x), signal);
    blocks.push_back({child.label, block});
  }
  Model adapted = model;
  adapted.chain = Series(std::move(blocks));
  adapted.standard_deviations.resize(0);
  adapted.parameters = Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()));
  return adapted;
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
      result.push_back({child.label, child.block, offset,
                        model.parameters.segment(offset, child.block.parameter_count())});
    }
    return result;
  }
  return {{"", model.chain, 0, model.parameters}};
}

}  // namespace blockid
