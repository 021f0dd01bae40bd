#include <blockid/blocks/fractional_filter.hpp>

#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/data/error.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace blockid {
namespace {

using detail::kConvolutionGuard;

void check_roots(const std::vector<std::complex<double>>& roots, const char* what, double largest) {
  for (const std::complex<double>& root : roots) {
    if (!std::isfinite(root.real()) || !std::isfinite(root.imag()) || root.imag() < 0.0) {
      fail("fractional: ", what, " must be finite, a pair given by its member with a positive imaginary part, got ",
           root.real(), ", ", root.imag());
    }
    if (!(std::abs(root) < largest))
      fail("fractional: ", what, " must lie inside the circle, got one of magnitude ", std::abs(root));
  }
}

/// The root inside the circle that has the magnitude response of the zero.
std::complex<double> inside(std::complex<double> zero) {
  const double radius = std::abs(zero);
  if (radius > 1.0 / kLargestZeroRadius) return zero / (radius * radius);
  return radius > kLargestZeroRadius ? zero * (kLargestZeroRadius / radius) : zero;
}

/// c_1, c_2 of 1 + c_1 x + c_2 x^2 with the given root or pair.
Eigen::Vector2d quadratic(std::complex<double> root) {
  if (root.imag() == 0.0) return {-root.real(), 0.0};
  return {-2.0 * root.real(), std::norm(root)};
}

/// delta_1 .. delta_n of (1 - z x) / (1 - x / conj z) = 1 + delta(x), or of the same for a pair.
Eigen::VectorXd all_pass_less_one(std::complex<double> zero, Index n) {
  const Eigen::Vector2d b = quadratic(zero);
  const Eigen::Vector2d a = quadratic(inside(zero));
  Eigen::VectorXd delta(n);
  for (Index k = 1; k <= n; ++k) {
    double value = k <= 2 ? b[k - 1] - a[k - 1] : 0.0;
    if (k > 1) value -= a[0] * delta[k - 2];
    if (k > 2) value -= a[1] * delta[k - 3];
    delta[k - 1] = value;
  }
  return delta;
}

std::string roots_text(const std::vector<std::complex<double>>& roots) {
  std::vector<double> numbers;
  for (const std::complex<double>& root : roots) {
    numbers.push_back(root.real());
    numbers.push_back(root.imag());
  }
  return detail::list_text(numbers);
}

Eigen::Map<const Eigen::VectorXd> mapped(const std::vector<double>& v) {
  return {v.data(), static_cast<Index>(v.size())};
}

/// What push_forward() remembers: how far it came, the responses found at the first tile, past rows of tangents.
class Memory {
 public:
  Memory(Index n, Index exponents, Index past, Index upstream)
      : n_(n), exponents_(exponents), past_(past), stride_(padded_columns(upstream)) {}

  Index size() const { return columns_at() + (past_ + kMaxTileRows) * stride_; }
  void place(std::span<double> memory) { data_ = memory.data(); }

  /// Samples seen so far.
  double& seen() { return data_[0]; }
  /// (n + 1,), zeros on both sides.
  double* response() { return data_ + 1 + kConvolutionGuard; }
  /// (n + 1,) d response / d exponent i.
  double* tangent(Index i) { return data_ + tangents_at() + i * (n_ + 1); }
  /// Rows -past .. kMaxTileRows - 1 of the upstream tangents before the filter.
  double* columns(Index row) { return data_ + columns_at() + (past_ + row) * stride_; }
  Index stride() const { return stride_; }

  /// The tile's upstream columns behind the rows of the past.
  void take(const Tangents& tangents) {
    for (Index t = 0; t < tangents.rows; ++t) {
      double* row = columns(t);
      std::copy_n(tangents.row(t), tangents.upstream, row);
      std::fill(row + tangents.upstream, row + stride_, 0.0);
    }
  }

  /// The last rows become the past of the next tile.
  void move_on(Index rows) {
    std::copy(columns(rows - past_), columns(rows), columns(-past_));
    seen() += static_cast<double>(rows);
  }

 private:
  Index tangents_at() const { return 1 + n_ + 1 + 2 * kConvolutionGuard; }
  Index columns_at() const { return tangents_at() + exponents_ * (n_ + 1); }

  Index n_;
  Index exponents_;
  Index past_;
  Index stride_;
  double* data_ = nullptr;
};

}  // namespace

FractionalFilter::FractionalFilter(FractionalRoots roots, Index n, Index n1, Index nk)
    : roots_(std::move(roots)), n_(n), n1_(n1), nk_(nk) {
  if (n1 < 0 || n < n1) fail("fractional: expected 0 <= n1 <= n coefficients, got n1=", n1, ", n=", n);
  if (nk < 0) fail("fractional: nk is a delay, expected >= 0, got ", nk);
  check_roots(roots_.poles, "poles", 1.0);
  check_roots(roots_.zeros, "zeros", std::numeric_limits<double>::infinity());
  const Index poles = std::ssize(roots_.poles);
  powers_.resize(n, poles + std::ssize(roots_.zeros));
  for (Index i = 0; i < poles; ++i) powers_.col(i) = root_powers(roots_.poles[static_cast<std::size_t>(i)], n);
  for (Index j = poles; j < powers_.cols(); ++j) {
    const std::complex<double> zero = roots_.zeros[static_cast<std::size_t>(j - poles)];
    powers_.col(j) = -root_powers(inside(zero), n);
    if (std::abs(zero) > 1.0 / kLargestZeroRadius) outside_.push_back({j, all_pass_less_one(zero, n)});
  }
}

Arguments FractionalFilter::arguments() const {
  Arguments result;
  if (!roots_.poles.empty()) result.emplace_back("poles", roots_text(roots_.poles));
  if (!roots_.zeros.empty()) result.emplace_back("zeros", roots_text(roots_.zeros));
  result.emplace_back("n", std::to_string(n_));
  if (n1_ != n_) result.emplace_back("n1", std::to_string(n1_));
  if (nk_ > 0) result.emplace_back("nk", std::to_string(nk_));
  return result;
}

std::vector<std::string> FractionalFilter::parameter_names() const {
  std::vector<std::string> names;
  for (std::size_t i = 1; i <= roots_.poles.size(); ++i) names.push_back("alpha" + std::to_string(i));
  for (std::size_t j = 1; j <= roots_.zeros.size(); ++j) names.push_back("beta" + std::to_string(j));
  for (Index k = n1_ + 1; k <= n_; ++k) names.push_back("d" + std::to_string(k));
  return names;
}

Eigen::VectorXd FractionalFilter::initial_parameters() const {
  Eigen::VectorXd theta = Eigen::VectorXd::Constant(parameter_count(), 0.5);
  const std::vector<double> a = expansion<double>({theta.data(), static_cast<std::size_t>(exponent_count())}, n_);
  theta.tail(n_ - n1_) = mapped(a).tail(n_ - n1_);
  return theta;
}

Eigen::VectorXd FractionalFilter::coefficients(std::span<const double> theta) const { return mapped(response(theta)); }

Eigen::MatrixXd FractionalFilter::coefficient_tangents(std::span<const double> theta) const {
  const Eigen::VectorXd a = mapped(expansion(theta, n1_));
  Eigen::MatrixXd tangents = Eigen::MatrixXd::Zero(n_ + 1, exponent_count());
  for (Index i = 0; i < exponent_count(); ++i) {
    tangents.col(i).head(n1_ + 1) = taylor_tangent(a, powers_.col(i).head(n1_));
  }
  for (Index j = 0; j < std::ssize(outside_); ++j) {
    const OutsideZero& zero = outside_[static_cast<std::size_t>(j)];
    const std::vector<double> rest = expansion(theta, n1_, j);
    std::vector<double> blended = rest;
    blend(blended, 1.0, zero.delta);
    tangents.col(zero.exponent).head(n1_ + 1) += mapped(blended) - mapped(rest);
  }
  return tangents;
}

void FractionalFilter::convolve(const double* h, const double* input, std::span<double> y) const {
  detail::kernels().convolve_signal(h, n_, input, y.data(), std::ssize(y));
}

Index FractionalFilter::tangent_memory(Index upstream, OwnColumns) const {
  return Memory(n_, exponent_count(), state_count(), upstream).size();
}

void FractionalFilter::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                                    std::span<const double> u, std::span<double> y, const Tangents& tangents,
                                    OwnColumns own) const {
  Memory kept(n_, exponent_count(), state_count(), tangents.upstream);
  kept.place(memory);
  if (kept.seen() == 0.0) {
    const Eigen::VectorXd h = coefficients(theta);
    const Eigen::MatrixXd dh = coefficient_tangents(theta);
    std::copy(h.begin(), h.end(), kept.response());
    std::copy_n(dh.data(), dh.size(), kept.tangent(0));
  }
  const Index rows = tangents.rows;
  kept.take(tangents);
  detail::kernels().convolve_columns(kept.response(), n_, kept.columns(-nk_), kept.stride(), tangents.data,
                                     tangents.stride, rows, kept.stride());

  const std::vector<double> all = joined(x, u);
  const double* input = all.data() + n_;
  convolve(kept.response(), input, y);
  double column[kMaxTileRows];
  for (Index i = 0; i < exponent_count(); ++i) {
    convolve(kept.tangent(i), input, {column, static_cast<std::size_t>(rows)});
    for (Index t = 0; t < rows; ++t) tangents.own(t)[i] = column[t];
  }
  for (Index t = 0; t < rows; ++t) {
    double* row = tangents.own(t) + exponent_count();
    for (Index k = n1_ + 1; k <= n_; ++k) *row++ = input[t - k];
    if (own == OwnColumns::parameters) continue;
    // x_j is the input at time -1 - j, which coefficient k = t - nk + 1 + j meets at time t of the record.
    const double first = kept.seen() + static_cast<double>(t - nk_ + 1);
    for (Index j = 0; j < state_count(); ++j) {
      const double k = first + static_cast<double>(j);
      *row++ = k >= 0.0 && k <= static_cast<double>(n_) ? kept.response()[static_cast<Index>(k)] : 0.0;
    }
  }
  kept.move_on(rows);
}

std::complex<double> FractionalFilter::frequency_response(std::span<const double> theta, double omega) const {
  const std::vector<double> h = response(theta);
  const std::complex<double> shift = std::polar(1.0, -omega);
  std::complex<double> sum = 0.0;
  for (std::size_t k = h.size(); k-- > 0;) sum = sum * shift + h[k];
  return std::polar(1.0, -omega * static_cast<double>(nk_)) * sum;
}

}  // namespace blockid
