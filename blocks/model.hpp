// A model: a chain of blocks with its numbers.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace blockid {

/// yhat = chain(theta, x0) u, sampled every sample_time_s seconds.
struct Model {
  AnyBlock chain;
  /// (n_theta,) in the order of chain.parameter_names().
  Eigen::VectorXd parameters;
  double sample_time_s = 1.0;
  /// (n_x,) state at the first sample, or empty for rest.
  Eigen::VectorXd initial_state = {};
  /// (n_theta,) of the parameters, zero for those held by convention; empty when unknown.
  Eigen::VectorXd standard_deviations = {};
  std::string input_name = "u";
  std::string output_name = "y";
  std::string input_unit = {};
  std::string output_unit = {};
};

/// The chain with its blocks' initial parameters, at rest.
Model make_model(AnyBlock chain, double sample_time_s = 1.0);

/// Throws Error unless sizes agree, numbers are finite and the sample time is positive.
void check(const Model& model);

/// yhat (N,) for the input u (N,) from the model's initial state; outputs are aligned by the chain's latency.
/// May hold non-finite values when the model is unstable.
Eigen::VectorXd simulate(const Model& model, const Eigen::VectorXd& u);

/// The signal at the input of every top-level block of the chain and at the output: (blocks + 1) signals of (N,).
std::vector<Eigen::VectorXd> simulate_signals(const Model& model, const Eigen::VectorXd& u);

/// The model with every unsettled range or knot placed for the signals that u drives through it. Parameters of a block
/// whose structure changed start anew from its initial_parameters().
Model adapt_structure(const Model& model, const Eigen::VectorXd& u);

/// Simulation of a model piece by piece; the pieces together equal one pass over the whole record.
class Simulator {
 public:
  explicit Simulator(Model model);

  const Model& model() const { return model_; }

  /// yhat (n,) of the next n inputs u (n,). The chain's latency shows as delay: a stream cannot look ahead.
  void push(std::span<const double> u, std::span<double> yhat);
  /// The next output for one input.
  double step(double u);
  /// Back to the model's initial state.
  void reset();

 private:
  Model model_;
  Eigen::VectorXd state_;
};

/// Place of a parameter by its name, e.g. "G1.b0"; throws Error that lists the names.
Index parameter_index(const Model& model, std::string_view name);

/// The part of the parameters that belongs to top-level child k of a Series chain, or all for any other block.
struct ChildParameters {
  std::string label;
  AnyBlock block;
  Index offset;
  Eigen::VectorXd parameters;
};

/// Top-level blocks of the chain with their parameters, in signal order.
std::vector<ChildParameters> top_level_blocks(const Model& model);

}  // namespace blockid
