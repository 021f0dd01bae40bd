// Static cubic spline in the B-spline basis.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/detail/scalar_part.hpp>
#include <blockid/blocks/knots.hpp>

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace blockid {

/// y_t = sum_{j=1..K+2} c_j B_j(u_t), cubic B-splines on the knots k_1 < .. < k_K, the end knots taken four times;
/// beyond the ends the tangents at k_1 and k_K go on, so that y has a continuous derivative everywhere.
///
/// theta = [c_1 .. c_{K+2}], (K + 2,): the ends are free, c_1 and c_{K+2} are the values at k_1 and k_K. No state.
/// Every cubic spline with these knots is one theta, and every input touches four coefficients (two beyond the ends).
/// Acts on the samples; oversampled() lets it act between them.
/// Source: de Boor, A Practical Guide to Splines, 1978, chapters IX and X.
class Spline {
 public:
  /// Knots uniform on [-1, 1] until adapted_to() places them. Throws Error unless 2 <= knots <= 1000.
  explicit Spline(Index knots, KnotPlacement placement = KnotPlacement::mixed);
  /// Knots uniform over the range. Throws Error likewise, and unless range.lower < range.upper.
  Spline(Index knots, SignalRange range);
  /// Throws Error unless there are 2 .. 1000 finite, strictly increasing knots.
  explicit Spline(std::vector<double> knots);

  /// (K,) in increasing order, the ends included.
  const std::vector<double>& knots() const { return knots_.values(); }

  std::string kind() const { return "spline"; }
  Arguments arguments() const { return knots_.arguments(); }
  Index parameter_count() const { return knots_.count() + 2; }
  std::vector<std::string> parameter_names() const;
  /// y = u: the Greville abscissae.
  Eigen::VectorXd initial_parameters() const { return greville_abscissae(); }
  bool is_linear() const { return false; }
  bool is_linear_in_parameters() const { return true; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    const std::vector<std::array<T, 4>> cubics = combined(theta);
    const PieceFinder find = knots_.finder();
    for (std::size_t t = 0; t < u.size(); ++t) {
      const auto p = static_cast<std::size_t>(find(detail::scalar_part(u[t])));
      const Piece& piece = (*pieces_)[p];
      const std::array<T, 4>& a = cubics[p];
      const T s = (u[t] - piece.origin) * piece.per_unit;
      y[t] = a[0] + s * (a[1] + s * (a[2] + s * a[3]));
    }
  }

  Index tangent_memory(Index, OwnColumns) const { return 0; }
  void push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                    std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own) const;

  /// Knots placed for v, unless knots or a range were given.
  Spline adapted_to(std::span<const double> v) const;
  Rescaled with_scaled_input(std::span<const double> theta, double k) const;
  Rescaled with_scaled_output(std::span<const double> theta, double k) const;

  /// (K + 2,) the abscissae g_j with sum_j g_j B_j(u) = u: means of three neighbouring knots.
  Eigen::VectorXd greville_abscissae() const;
  /// (K + 2,) theta with y = f(u) at the Greville abscissae; exact when f is a spline with these knots, e.g. a cubic.
  Eigen::VectorXd coefficients_of(const std::function<double(double)>& f) const;

 private:
  /// The four B-splines that are not zero on a piece, as cubics in s = (u - origin) per_unit:
  /// B_{first + j} = sum_k basis[k][j] s^k.
  struct Piece {
    double origin;
    double per_unit;
    std::size_t first;
    double basis[4][4];
  };

  explicit Spline(Knots knots);

  static std::vector<Piece> make_pieces(const Knots& knots);

  /// Every piece as one cubic in s.
  template <class T>
  std::vector<std::array<T, 4>> combined(std::span<const T> theta) const {
    std::vector<std::array<T, 4>> cubics(pieces_->size());
    for (std::size_t p = 0; p < cubics.size(); ++p) {
      const Piece& piece = (*pieces_)[p];
      for (std::size_t k = 0; k < 4; ++k) {
        T sum = piece.basis[k][0] * theta[piece.first];
        for (std::size_t j = 1; j < 4; ++j) sum += piece.basis[k][j] * theta[piece.first + j];
        cubics[p][k] = sum;
      }
    }
    return cubics;
  }

  Knots knots_;
  std::shared_ptr<const std::vector<Piece>> pieces_;
};

}  // namespace blockid
