#include <blockid/blocks/spline.hpp>

#include <Eigen/LU>
#include <algorithm>

namespace blockid {
namespace {

using Cubic = std::array<double, 4>;

/// (offset + slope s) p(s) for p of degree 2 at most.
Cubic times_line(double offset, double slope, const Cubic& p) {
  Cubic product{};
  for (std::size_t k = 0; k < 4; ++k) product[k] = offset * p[k] + (k > 0 ? slope * p[k - 1] : 0.0);
  return product;
}

/// k_1 k_1 k_1 k_1 k_2 .. k_{K-1} k_K k_K k_K k_K.
std::vector<double> with_repeated_ends(const Knots& knots) {
  std::vector<double> extended(3, knots.values().front());
  extended.insert(extended.end(), knots.values().begin(), knots.values().end());
  extended.insert(extended.end(), 3, knots.values().back());
  return extended;
}

/// B_i .. B_{i+3} on the interval between k[i+3] and k[i+4] as cubics in s = (u - k[i+3]) / width: de Boor's recurrence
/// (1978, equation X (4)) on polynomials instead of numbers.
std::array<Cubic, 4> basis_on_interval(const std::vector<double>& k, std::size_t i) {
  const std::size_t last = i + 3;
  const double width = k[last + 1] - k[last];
  // At degree d the entry 3 - d + m is B_{last-d+m}.
  std::array<Cubic, 4> basis{};
  basis[3] = {1.0, 0.0, 0.0, 0.0};
  for (std::size_t d = 1; d <= 3; ++d) {
    for (std::size_t j = last - d; j <= last; ++j) {
      const std::size_t place = j - i;
      Cubic sum{};
      if (j > last - d) {
        const double span = k[j + d] - k[j];
        sum = times_line((k[last] - k[j]) / span, width / span, basis[place]);
      }
      if (j < last) {
        const double span = k[j + d + 1] - k[j + 1];
        const Cubic falling = times_line((k[j + d + 1] - k[last]) / span, -width / span, basis[place + 1]);
        for (std::size_t n = 0; n < 4; ++n) sum[n] += falling[n];
      }
      basis[place] = sum;
    }
  }
  return basis;
}

}  // namespace

Spline::Spline(Index knots, KnotPlacement placement) : Spline(Knots("spline", knots, placement)) {}

Spline::Spline(Index knots, SignalRange range) : Spline(Knots("spline", knots, range)) {}

Spline::Spline(std::vector<double> knots) : Spline(Knots("spline", std::move(knots))) {}

Spline::Spline(Knots knots)
    : knots_(std::move(knots)), pieces_(std::make_shared<const std::vector<Piece>>(make_pieces(knots_))) {}

std::vector<Spline::Piece> Spline::make_pieces(const Knots& knots) {
  const std::vector<double> extended = with_repeated_ends(knots);
  const auto intervals = static_cast<std::size_t>(knots.count() - 1);
  std::vector<Piece> pieces(intervals + 2);
  for (std::size_t i = 0; i < intervals; ++i) {
    const std::array<Cubic, 4> basis = basis_on_interval(extended, i);
    Piece& piece = pieces[i + 1];
    piece.origin = extended[i + 3];
    piece.per_unit = 1.0 / (extended[i + 4] - extended[i + 3]);
    piece.first = i;
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t k = 0; k < 4; ++k) piece.basis[k][j] = basis[j][k];
    }
  }
  // Tangents at the ends: the first two coefficients of the cubic at s = 0 and at s = 1.
  Piece& left = pieces.front();
  left = pieces[1];
  Piece& right = pieces.back();
  right = pieces[intervals];
  right.origin = extended.back();
  for (std::size_t j = 0; j < 4; ++j) {
    const double b1 = right.basis[1][j];
    const double b2 = right.basis[2][j];
    const double b3 = right.basis[3][j];
    // Only B_{K+2} differs from zero at the last knot, and only it and B_{K+1} have a slope there.
    right.basis[0][j] = j == 3 ? 1.0 : 0.0;
    right.basis[1][j] = j < 2 ? 0.0 : b1 + 2.0 * b2 + 3.0 * b3;
    for (Piece* end : {&left, &right}) end->basis[2][j] = end->basis[3][j] = 0.0;
  }
  return pieces;
}

std::vector<std::string> Spline::parameter_names() const {
  std::vector<std::string> names;
  for (Index j = 1; j <= parameter_count(); ++j) names.push_back("c" + std::to_string(j));
  return names;
}

void Spline::push_forward(std::span<const double> theta, std::span<double>, std::span<double>,
                          std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns) const {
  const std::vector<Cubic> cubics = combined(theta);
  const PieceFinder find = knots_.finder();
  for (Index t = 0; t < tangents.rows; ++t) {
    const double input = u[static_cast<std::size_t>(t)];
    const auto p = static_cast<std::size_t>(find(input));
    const Piece& piece = (*pieces_)[p];
    const Cubic& a = cubics[p];
    const double s = (input - piece.origin) * piece.per_unit;
    y[static_cast<std::size_t>(t)] = a[0] + s * (a[1] + s * (a[2] + s * a[3]));
    const double slope = (a[1] + s * (2.0 * a[2] + s * 3.0 * a[3])) * piece.per_unit;
    double* row = tangents.row(t);
    for (Index c = 0; c < tangents.upstream; ++c) row[c] *= slope;
    double* own = tangents.own(t);
    std::fill_n(own, theta.size(), 0.0);
    const auto& basis = piece.basis;
    for (std::size_t j = 0; j < 4; ++j) {
      own[piece.first + j] = basis[0][j] + s * (basis[1][j] + s * (basis[2][j] + s * basis[3][j]));
    }
  }
}

Spline Spline::adapted_to(std::span<const double> v) const {
  return knots_.settled() ? *this : Spline(knots_.adapted_to(v));
}

Rescaled Spline::with_scaled_input(std::span<const double> theta, double k) const {
  Eigen::VectorXd coefficients = Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count());
  if (k < 0.0) coefficients.reverseInPlace();
  return {Spline(knots_.scaled(k)), coefficients};
}

Rescaled Spline::with_scaled_output(std::span<const double> theta, double k) const {
  return {*this, k * Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count())};
}

Eigen::VectorXd Spline::greville_abscissae() const {
  const std::vector<double> extended = with_repeated_ends(knots_);
  Eigen::VectorXd abscissae(parameter_count());
  for (Index j = 0; j < abscissae.size(); ++j) {
    const double* knot = extended.data() + j + 1;
    abscissae[j] = knot[0] / 3.0 + knot[1] / 3.0 + knot[2] / 3.0;
  }
  abscissae[0] = extended.front();
  abscissae[abscissae.size() - 1] = extended.back();
  return abscissae;
}

Eigen::VectorXd Spline::coefficients_of(const std::function<double(double)>& f) const {
  const Eigen::VectorXd abscissae = greville_abscissae();
  const PieceFinder find = knots_.finder();
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(abscissae.size(), abscissae.size());
  for (Index row = 0; row < abscissae.size(); ++row) {
    const Piece& piece = (*pieces_)[static_cast<std::size_t>(find(abscissae[row]))];
    const double s = (abscissae[row] - piece.origin) * piece.per_unit;
    for (std::size_t j = 0; j < 4; ++j) {
      values(row, static_cast<Index>(piece.first + j)) =
          piece.basis[0][j] + s * (piece.basis[1][j] + s * (piece.basis[2][j] + s * piece.basis[3][j]));
    }
  }
  return values.partialPivLu().solve(abscissae.unaryExpr(f));
}

}  // namespace blockid
