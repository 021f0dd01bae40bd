// A block whose parameters depend on fewer numbers.
#pragma once

#include <blockid/blocks/any_block.hpp>

#include <complex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// Inner parameter = scale theta[index] + offset.
struct Tie {
  Index index = 0;
  double scale = 1.0;
  double offset = 0.0;
};

/// y = B(M theta + c, x) u: inner parameter k is scale_k theta_{index_k} + offset_k.
///
/// Several inner parameters may follow one theta_j: two filters share poles, or one holds 1 - alpha where the other
/// holds alpha. theta_j bears the name of the first inner parameter that follows it. x is that of the inner block.
/// Tangents: dy/dtheta_j = sum of scale_k dy/d(inner k) over the k that follow j.
class Tied {
 public:
  /// Throws Error unless there is one tie for each inner parameter, every index from 0 to the largest is used, and
  /// scales (not 0) and offsets are finite.
  Tied(AnyBlock inner, std::vector<Tie> ties);

  const AnyBlock& inner() const { return inner_; }
  const std::vector<Tie>& ties() const { return ties_; }

  /// (inner parameters,) M theta + c.
  Eigen::VectorXd inner_parameters(std::span<const double> theta) const;
  /// theta read from the first inner parameter that follows each; the inverse of inner_parameters() on its range.
  Eigen::VectorXd from_inner(std::span<const double> inner_theta) const;

  std::string kind() const { return "tied"; }
  Arguments arguments() const;
  Index parameter_count() const { return std::ssize(first_); }
  Index state_count() const { return inner_.state_count(); }
  std::vector<std::string> parameter_names() const;
  Eigen::VectorXd initial_parameters() const;
  ParameterBounds bounds() const;
  bool is_linear() const { return inner_.is_linear(); }
  bool is_linear_in_parameters() const { return inner_.is_linear_in_parameters(); }
  Index latency() const { return inner_.latency(); }

  void apply(std::span<const double> theta, std::span<double> x, std::span<const double> u, std::span<double> y) const;
  void apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
             std::span<TileJet> y) const;

  Index tangent_memory(Index upstream, OwnColumns own) const;
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  std::optional<std::complex<double>> frequency_response(std::span<const double> theta, double omega) const;

 private:
  Index inner_stride(Index upstream, OwnColumns own) const;

  AnyBlock inner_;
  std::vector<Tie> ties_;
  /// First inner parameter that follows theta_j.
  std::vector<Index> first_;
};

}  // namespace blockid
