// AnyBlock: any block by value. One virtual call a block and tile; no base class to inherit.
#pragma once

#include <blockid/blocks/arguments.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/blocks/detail/jet_push_forward.hpp>
#include <blockid/blocks/detail/kernels.hpp>

#include <Eigen/Core>
#include <complex>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace blockid {

class AnyBlock;

/// A block with the name it bears in a chain, e.g. `G1` in `G1=rational(nb=3,na=3)`; the name may be empty.
struct LabelledBlock;

/// A block and its parameters after a change that leaves the simulated chain as it was.
struct Rescaled;

/// Lower and upper limits of the parameters, (parameter_count(),) each; infinite where there is none.
struct ParameterBounds {
  Eigen::VectorXd lower;
  Eigen::VectorXd upper;
};

/// y = B(theta, x) u for a block of any type, held by value (copies share the immutable structure).
///
/// Members that a block leaves out are deduced:
/// | member                          | meaning                                               | when absent        |
/// |---------------------------------|-------------------------------------------------------|--------------------|
/// | state_count()                   | n_x, numbers carried from tile to tile                | 0: a static block  |
/// | push_forward, tangent_memory    | analytic tangents                                     | Jets of apply      |
/// | push_negated                    | push_forward, its rows packed and negated             | push_forward, copy |
/// | column_order(own)               | which own column is which parameter (or state)        | as they come       |
/// | kind()                          | name in the text form                                 | "custom"           |
/// | arguments()                     | structure as key=value pairs of the text form         | none               |
/// | parameter_names()               | (n_theta,) names                                      | theta1, theta2 ... |
/// | initial_parameters()            | (n_theta,) a harmless start                           | zeros              |
/// | is_linear()                     | superposition holds for x = 0                         | false              |
/// | is_linear_in_parameters()       | y = y0(u) + Phi(u) theta for given u and x = 0        | false              |
/// | frequency_response(theta, w)    | G(e^{jw}), w in radians a sample                      | none               |
/// | latency()                       | samples by which the output lags on purpose           | 0                  |
/// | adapted_to(v)                   | the block with range or knots placed for the signal v | itself             |
/// | with_scaled_input(theta, k)     | g with g(k u) = f(u)                                  | none               |
/// | with_scaled_output(theta, k)    | g with g(u) = k f(u)                                  | none               |
/// | with_scaled_signals(theta, k)   | g with g(k u) = k f(u)                                | none               |
/// | bounds()                        | limits of the parameters                              | none               |
/// | gain_parameter(theta)           | index of the number to hold when the gain is a gauge  | none               |
class AnyBlock {
 public:
  AnyBlock() = delete;

  // clang-format off
  /// Holds a copy of `block`.
  template <class B>
    requires(!std::is_same_v<std::remove_cvref_t<B>, AnyBlock> && Block<std::remove_cvref_t<B>>)
  AnyBlock(B&& block)  // NOLINT(google-explicit-constructor, bugprone-forwarding-reference-overload): a value wrapper
      : self_(std::make_shared<const Holder<std::remove_cvref_t<B>>>(std::forward<B>(block))) {}
  // clang-format on

  std::string kind() const { return self_->kind(); }
  Arguments arguments() const { return self_->arguments(); }
  Index parameter_count() const { return self_->parameter_count(); }
  Index state_count() const { return self_->state_count(); }
  std::vector<std::string> parameter_names() const { return self_->parameter_names(); }
  Eigen::VectorXd initial_parameters() const { return self_->initial_parameters(); }
  bool is_static() const { return self_->state_count() == 0; }
  bool is_linear() const { return self_->is_linear(); }
  bool is_linear_in_parameters() const { return self_->is_linear_in_parameters(); }
  Index latency() const { return self_->latency(); }
  ParameterBounds bounds() const { return self_->bounds(); }

  /// Children of a Series or Parallel, empty for all others.
  std::vector<LabelledBlock> children() const;

  /// y = B(theta, x) u. theta: (parameter_count(),), x: (state_count(),) in and out, u and y: (N,), not overlapping.
  void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u, std::span<double> y) const {
    self_->apply(theta, x, u, y);
  }
  void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
             std::span<TileJet> y) const {
    self_->apply(theta, x, u, y);
  }

  /// Columns that push_forward() appends: n_theta, and n_x more when the initial state is asked for.
  Index own_columns(OwnColumns own) const {
    return parameter_count() + (own == OwnColumns::parameters_and_state ? state_count() : 0);
  }

  /// For each own column the number that it differentiates: k < n_theta is theta_k, n_theta + j is x_j(0).
  std::vector<Index> column_order(OwnColumns own) const { return self_->column_order(own); }

  /// Doubles that push_forward() remembers between tiles; the caller owns them and sets them to zero at the start.
  Index tangent_memory(Index upstream, OwnColumns own) const { return self_->tangent_memory(upstream, own); }

  /// One tile: y = B u, x advanced, and the tangents du/dp in `tangents` replaced by dy/dp with the own columns beside.
  /// u, y: (tangents.rows,), not overlapping; memory: (tangent_memory(upstream, own),).
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const {
    self_->push_forward(theta, x, memory, u, y, tangents, own);
  }

  /// push_forward() at the end of a chain: the rows -dy/dp, own columns of the parameters included, packed into
  /// `target`: (rows, upstream + n_theta) row-major, nothing behind it written. The tile is left in any state. False
  /// when a derivative is not finite.
  bool push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, double* target) const {
    return self_->push_negated(theta, x, memory, u, y, tangents, target);
  }

  /// G(e^{jw}) of a linear block at w in radians a sample; nothing for blocks that have none.
  std::optional<std::complex<double>> frequency_response(std::span<const double> theta, double omega) const {
    return self_->frequency_response(theta, omega);
  }

  /// The block with range or knots placed for an input like v: (N,); itself when its structure is already settled.
  AnyBlock adapted_to(std::span<const double> v) const { return self_->adapted_to(*this, v); }

  /// g and its parameters with g(k u) = f(u), k != 0; nothing when the family is not closed under it.
  std::optional<Rescaled> with_scaled_input(std::span<const double> theta, double k) const;

  /// g and its parameters with g(u) = k f(u), k != 0; nothing when the family is not closed under it.
  std::optional<Rescaled> with_scaled_output(std::span<const double> theta, double k) const;

  /// g with g(k u) = k f(u), where the family of blocks is closed under scaling of input and output together but not of
  /// either alone: saturation and dead zone, whose slope is fixed.
  std::optional<Rescaled> with_scaled_signals(std::span<const double> theta, double k) const;

  /// Index of the parameter that fixes the block's gain best at theta (the largest numerator coefficient).
  std::optional<Index> gain_parameter(std::span<const double> theta) const { return self_->gain_parameter(theta); }

  /// The block held, or nullptr when it is of another type.
  template <class B>
  const B* target() const {
    const auto* holder = dynamic_cast<const Holder<B>*>(self_.get());
    return holder == nullptr ? nullptr : &holder->block;
  }

 private:
  struct Interface {
    Interface() = default;
    Interface(const Interface&) = delete;
    Interface& operator=(const Interface&) = delete;
    virtual ~Interface() = default;
    virtual std::string kind() const = 0;
    virtual Arguments arguments() const = 0;
    virtual Index parameter_count() const = 0;
    virtual Index state_count() const = 0;
    virtual std::vector<std::string> parameter_names() const = 0;
    virtual Eigen::VectorXd initial_parameters() const = 0;
    virtual bool is_linear() const = 0;
    virtual bool is_linear_in_parameters() const = 0;
    virtual Index latency() const = 0;
    virtual ParameterBounds bounds() const = 0;
    virtual std::vector<LabelledBlock> children() const = 0;
    virtual void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u,
                       std::span<double> y) const = 0;
    virtual void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
                       std::span<TileJet> y) const = 0;
    virtual std::vector<Index> column_order(OwnColumns own) const = 0;
    virtual Index tangent_memory(Index upstream, OwnColumns own) const = 0;
    virtual void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                              std::span<const double> u, std::span<double> y, const Tangents& tangents,
                              OwnColumns own) const = 0;
    virtual bool push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                              std::span<const double> u, std::span<double> y, const Tangents& tangents,
                              double* target) const = 0;
    virtual std::optional<std::complex<double>> frequency_response(std::span<const double> theta,
                                                                   double omega) const = 0;
    virtual AnyBlock adapted_to(const AnyBlock& self, std::span<const double> v) const = 0;
    virtual std::optional<Rescaled> with_scaled_input(std::span<const double> theta, double k) const = 0;
    virtual std::optional<Rescaled> with_scaled_output(std::span<const double> theta, double k) const = 0;
    virtual std::optional<Rescaled> with_scaled_signals(std::span<const double> theta, double k) const = 0;
    virtual std::optional<Index> gain_parameter(std::span<const double> theta) const = 0;
  };

  template <class B>
  struct Holder;

  std::shared_ptr<const Interface> self_;
};

struct LabelledBlock {
  std::string label;
  AnyBlock block;
};

struct Rescaled {
  AnyBlock block;
  Eigen::VectorXd parameters;
};

template <class B>
struct AnyBlock::Holder final : AnyBlock::Interface {
  explicit Holder(B held) : block(std::move(held)) {}

  B block;

  std::string kind() const override {
    if constexpr (requires { block.kind(); }) return std::string(block.kind());
    return "custom";
  }

  Arguments arguments() const override {
    if constexpr (requires { block.arguments(); }) {
      return block.arguments();
    } else {
      return {};
    }
  }

  Index parameter_count() const override { return static_cast<Index>(block.parameter_count()); }

  Index state_count() const override {
    if constexpr (requires { block.state_count(); }) {
      return static_cast<Index>(block.state_count());
    } else {
      return 0;
    }
  }

  std::vector<std::string> parameter_names() const override {
    if constexpr (requires { block.parameter_names(); }) {
      return block.parameter_names();
    } else {
      std::vector<std::string> names;
      for (Index k = 1; k <= parameter_count(); ++k) names.push_back("theta" + std::to_string(k));
      return names;
    }
  }

  Eigen::VectorXd initial_parameters() const override {
    if constexpr (requires { block.initial_parameters(); }) {
      return block.initial_parameters();
    } else {
      return Eigen::VectorXd::Zero(parameter_count());
    }
  }

  bool is_linear() const override {
    if constexpr (requires { block.is_linear(); }) {
      return block.is_linear();
    } else {
      return false;
    }
  }

  bool is_linear_in_parameters() const override {
    if constexpr (requires { block.is_linear_in_parameters(); }) {
      return block.is_linear_in_parameters();
    } else {
      return false;
    }
  }

  Index latency() const override {
    if constexpr (requires { block.latency(); }) {
      return static_cast<Index>(block.latency());
    } else {
      return 0;
    }
  }

  ParameterBounds bounds() const override {
    if constexpr (requires { block.bounds(); }) {
      return block.bounds();
    } else {
      return {Eigen::VectorXd::Constant(parameter_count(), -detail::kInfinity),
              Eigen::VectorXd::Constant(parameter_count(), detail::kInfinity)};
    }
  }

  std::vector<LabelledBlock> children() const override {
    if constexpr (requires { block.children(); }) {
      return block.children();
    } else {
      return {};
    }
  }

  void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u,
             std::span<double> y) const override {
    block.apply(theta, x, u, y);
  }

  void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
             std::span<TileJet> y) const override {
    block.apply(theta, x, u, y);
  }

  std::vector<Index> column_order(OwnColumns own) const override {
    if constexpr (requires { block.column_order(own); }) {
      return block.column_order(own);
    } else {
      std::vector<Index> order(static_cast<std::size_t>(own_count(own)));
      for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Index>(k);
      return order;
    }
  }

  Index tangent_memory(Index upstream, OwnColumns own) const override {
    if constexpr (kAnalytic) {
      return block.tangent_memory(upstream, own);
    } else {
      return detail::jet_tangent_memory(state_count(), upstream, own_count(own)) + 1;
    }
  }

  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents,
                    OwnColumns own) const override {
    if constexpr (kAnalytic) {
      block.push_forward(theta, x, memory, u, y, tangents, own);
    } else if (state_count() == 0) {
      detail::push_static_by_jets(block, theta, u, y, tangents);
    } else {
      push_dynamic(theta, x, memory, u, y, tangents, own);
    }
  }

  bool push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents,
                    double* target) const override {
    if constexpr (requires { block.push_negated(theta, x, memory, u, y, tangents, target); }) {
      return block.push_negated(theta, x, memory, u, y, tangents, target);
    } else {
      push_forward(theta, x, memory, u, y, tangents, OwnColumns::parameters);
      return detail::kernels().negated_rows(tangents.data, tangents.rows, tangents.stride,
                                            tangents.upstream + parameter_count(), nullptr, target);
    }
  }

  std::optional<std::complex<double>> frequency_response(std::span<const double> theta, double omega) const override {
    if constexpr (requires { block.frequency_response(theta, omega); }) {
      return block.frequency_response(theta, omega);
    } else {
      return std::nullopt;
    }
  }

  AnyBlock adapted_to(const AnyBlock& self, std::span<const double> v) const override {
    if constexpr (requires { block.adapted_to(v); }) {
      return AnyBlock(block.adapted_to(v));
    } else {
      return self;
    }
  }

  std::optional<Rescaled> with_scaled_input(std::span<const double> theta, double k) const override {
    if constexpr (requires { block.with_scaled_input(theta, k); }) {
      return block.with_scaled_input(theta, k);
    } else {
      return std::nullopt;
    }
  }

  std::optional<Rescaled> with_scaled_output(std::span<const double> theta, double k) const override {
    if constexpr (requires { block.with_scaled_output(theta, k); }) {
      return block.with_scaled_output(theta, k);
    } else {
      return std::nullopt;
    }
  }

  std::optional<Rescaled> with_scaled_signals(std::span<const double> theta, double k) const override {
    if constexpr (requires { block.with_scaled_signals(theta, k); }) {
      return block.with_scaled_signals(theta, k);
    } else {
      return std::nullopt;
    }
  }

  std::optional<Index> gain_parameter(std::span<const double> theta) const override {
    if constexpr (requires { block.gain_parameter(theta); }) {
      return block.gain_parameter(theta);
    } else {
      return std::nullopt;
    }
  }

 private:
  static constexpr bool kAnalytic =
      requires(const B& b, std::span<const double> theta, std::span<double> x, std::span<double> memory,
               std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) {
    b.push_forward(theta, x, memory, u, y, tangents, own);
    b.tangent_memory(Index{}, own);
  };

  Index own_count(OwnColumns own) const {
    return parameter_count() + (own == OwnColumns::parameters_and_state ? state_count() : 0);
  }

  /// The first double of the memory says whether the initial state has been seeded.
  void push_dynamic(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const {
    const std::span<double> jets = memory.subspan(1);
    const Index stride = padded_columns(tangents.upstream + own_count(own));
    if (memory[0] == 0.0 && own == OwnColumns::parameters_and_state) {
      for (Index j = 0; j < state_count(); ++j) {
        jets[static_cast<std::size_t>(j * stride + tangents.upstream + parameter_count() + j)] = 1.0;
      }
    }
    memory[0] = 1.0;
    detail::push_dynamic_by_jets(block, theta, x, jets, u, y, tangents, own_count(own));
  }
};

inline std::vector<LabelledBlock> AnyBlock::children() const { return self_->children(); }

inline std::optional<Rescaled> AnyBlock::with_scaled_input(std::span<const double> theta, double k) const {
  return self_->with_scaled_input(theta, k);
}

inline std::optional<Rescaled> AnyBlock::with_scaled_output(std::span<const double> theta, double k) const {
  return self_->with_scaled_output(theta, k);
}

inline std::optional<Rescaled> AnyBlock::with_scaled_signals(std::span<const double> theta, double k) const {
  return self_->with_scaled_signals(theta, k);
}

}  // namespace blockid
