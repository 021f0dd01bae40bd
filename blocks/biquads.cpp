#include <blockid/blocks/biquads.hpp>

#include <blockid/blocks/detail/direct_form.hpp>
#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <array>
#include <numbers>

namespace blockid {
namespace {

constexpr detail::DirectFormTangents::Shape kShape{.nb = 2, .na = 2, .nk = 0, .first_b = 1};

using Tile = std::array<double, static_cast<std::size_t>(kMaxTileRows)>;
/// 1 + c1 q^-1 + c2 q^-2.
using Quadratic = std::array<double, 2>;

/// Quadratics with the given roots: conjugate pairs, then the real roots two by two.
std::vector<Quadratic> quadratics(std::vector<std::complex<double>> roots, Index sections, const char* what) {
  if (std::ssize(roots) > 2 * sections) {
    fail("biquads: expected at most ", 2 * sections, " ", what, " (two a section), got ", roots.size());
  }
  std::vector<Quadratic> result;
  std::vector<double> real;
  while (!roots.empty()) {
    const std::complex<double> root = roots.back();
    roots.pop_back();
    if (root.imag() == 0.0) {
      real.push_back(root.real());
      continue;
    }
    const double tolerance = 1e-9 * (1.0 + std::abs(root));
    const auto partner = std::find_if(roots.begin(), roots.end(), [&](const std::complex<double>& other) {
      return std::abs(other - std::conj(root)) <= tolerance;
    });
    if (partner == roots.end()) {
      fail("biquads: ", what, " must be closed under conjugation, found no partner of ", root.real(),
           root.imag() < 0.0 ? " - " : " + ", std::abs(root.imag()), "j");
    }
    roots.erase(partner);
    result.push_back({-2.0 * root.real(), std::norm(root)});
  }
  std::sort(real.begin(), real.end());
  if (real.size() % 2 == 1) real.push_back(0.0);
  for (std::size_t k = 0; k < real.size(); k += 2) result.push_back({-real[k] - real[k + 1], real[k] * real[k + 1]});
  result.resize(static_cast<std::size_t>(sections), Quadratic{0.0, 0.0});
  return result;
}

}  // namespace

Biquads::Biquads(Index sections, bool stable) : sections_(sections), stable_(stable) {
  if (sections < 1) fail("biquads: expected at least 1 section, got ", sections);
}

Arguments Biquads::arguments() const {
  Arguments result = {{"sections", std::to_string(sections_)}};
  if (stable_) result.emplace_back("stable", "true");
  return result;
}

std::vector<std::string> Biquads::parameter_names() const {
  std::vector<std::string> names = {"g"};
  for (Index i = 1; i <= sections_; ++i) {
    const std::string tail = "_" + std::to_string(i);
    for (const char* name : {"b1", "b2"}) names.push_back(name + tail);
    for (const char* name : stable_ ? std::array{"p", "q"} : std::array{"a1", "a2"}) names.push_back(name + tail);
  }
  return names;
}

Eigen::VectorXd Biquads::initial_parameters() const {
  Eigen::VectorXd theta(parameter_count());
  theta[0] = 1.0;
  for (Index i = 0; i < sections_; ++i) {
    const double angle = std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(sections_);
    const double c1 = -std::cos(angle);
    const double c2 = 0.25;
    theta[1 + 4 * i] = c1;
    theta[2 + 4 * i] = c2;
    set_denominator(theta, i, c1, c2);
  }
  return theta;
}

void Biquads::set_denominator(Eigen::VectorXd& theta, Index i, double a1, double a2) const {
  theta[3 + 4 * i] = stable_ ? std::atanh(a1 / (1.0 + a2)) : a1;
  theta[4 + 4 * i] = stable_ ? std::atanh(a2) : a2;
}

void Biquads::filter(std::span<const double> theta, std::span<double> x, std::span<const double> u,
                     std::span<double> y) const {
  const detail::Kernels& kernel = detail::kernels();
  Tile tiles[2];
  for (std::size_t start = 0; start < u.size(); start += static_cast<std::size_t>(kMaxTileRows)) {
    const std::size_t rows = std::min(static_cast<std::size_t>(kMaxTileRows), u.size() - start);
    const double* input = tiles[0].data();
    for (std::size_t t = 0; t < rows; ++t) tiles[0][t] = theta[0] * u[start + t];
    for (std::size_t i = 0; i < static_cast<std::size_t>(sections_); ++i) {
      const Section<double> s = section(theta, i);
      const double b[3] = {1.0, s.b1, s.b2};
      const double a[3] = {1.0, s.a1, s.a2};
      double* output = i + 1 == static_cast<std::size_t>(sections_) ? y.data() + start : tiles[(i + 1) % 2].data();
      kernel.filter_signal(b, a, 2, x.data() + 2 * i, input, output, static_cast<Index>(rows));
      input = output;
    }
  }
}

std::vector<Index> Biquads::column_order(OwnColumns own) const {
  std::vector<Index> order = {0};
  for (Index i = 0; i < sections_; ++i) {
    for (Index k = 0; k < 4; ++k) order.push_back(1 + 4 * i + k);
    if (own == OwnColumns::parameters_and_state) {
      for (Index j = 0; j < 2; ++j) order.push_back(parameter_count() + 2 * i + j);
    }
  }
  return order;
}

Index Biquads::tangent_memory(Index upstream, OwnColumns own) const {
  Index total = 0;
  for (Index i = 0; i < sections_; ++i) {
    total += detail::DirectFormTangents::memory(kShape, upstream + 1 + i * kShape.own(own));
  }
  return total;
}

void Biquads::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                           std::span<const double> u, std::span<double> y, const Tangents& tangents,
                           OwnColumns own) const {
  const auto rows = static_cast<std::size_t>(tangents.rows);
  Tile tiles[2];
  std::span<const double> input(tiles[0].data(), rows);
  for (std::size_t t = 0; t < rows; ++t) {
    double* row = tangents.row(static_cast<Index>(t));
    for (Index c = 0; c < tangents.upstream; ++c) row[c] *= theta[0];
    row[tangents.upstream] = u[t];
    tiles[0][t] = theta[0] * u[t];
  }
  Tangents through = tangents;
  through.upstream += 1;
  for (std::size_t i = 0; i < static_cast<std::size_t>(sections_); ++i) {
    const Section<double> s = section(theta, i);
    const double b[3] = {1.0, s.b1, s.b2};
    const double a[2] = {s.a1, s.a2};
    const bool last = i + 1 == static_cast<std::size_t>(sections_);
    const std::span<double> output = last ? y : std::span<double>(tiles[(i + 1) % 2]).first(rows);
    const auto needed = static_cast<std::size_t>(detail::DirectFormTangents::memory(kShape, through.upstream));
    detail::DirectFormTangents::push(detail::DirectForm<double>(b, a, 0), kShape, x.subspan(2 * i, 2),
                                     memory.first(needed), input, output, through, own);
    if (stable_) {
      const double tanh_p = std::tanh(theta[3 + 4 * i]);
      const double a1_p = (1.0 + s.a2) * (1.0 - tanh_p * tanh_p);
      const double a2_q = 1.0 - s.a2 * s.a2;
      for (Index t = 0; t < tangents.rows; ++t) {
        double* column = through.own(t) + 2;
        const double dy_da1 = column[0];
        column[0] = a1_p * dy_da1;
        column[1] = a2_q * (column[1] + tanh_p * dy_da1);
      }
    }
    through.upstream += kShape.own(own);
    memory = memory.subspan(needed);
    input = output;
  }
}

std::complex<double> Biquads::frequency_response(std::span<const double> theta, double omega) const {
  const std::complex<double> shift = std::polar(1.0, -omega);
  std::complex<double> product = theta[0];
  for (std::size_t i = 0; i < static_cast<std::size_t>(sections_); ++i) {
    const Section<double> s = section(theta, i);
    product *= (1.0 + shift * (s.b1 + shift * s.b2)) / (1.0 + shift * (s.a1 + shift * s.a2));
  }
  return product;
}

Rescaled Biquads::with_scaled_input(std::span<const double> theta, double k) const {
  return with_scaled_output(theta, 1.0 / k);
}

Rescaled Biquads::with_scaled_output(std::span<const double> theta, double k) const {
  Eigen::VectorXd scaled = Eigen::Map<const Eigen::VectorXd>(theta.data(), parameter_count());
  scaled[0] *= k;
  return {*this, scaled};
}

Eigen::VectorXd Biquads::from_roots(double g, const std::vector<std::complex<double>>& zeros,
                                    const std::vector<std::complex<double>>& poles) const {
  if (stable_) {
    for (const std::complex<double>& pole : poles) {
      if (!(std::abs(pole) < 1.0)) {
        fail("biquads: stable sections need poles within the unit circle, got one of magnitude ", std::abs(pole));
      }
    }
  }
  const std::vector<Quadratic> numerators = quadratics(zeros, sections_, "zeros");
  const std::vector<Quadratic> denominators = quadratics(poles, sections_, "poles");
  Eigen::VectorXd theta(parameter_count());
  theta[0] = g;
  for (Index i = 0; i < sections_; ++i) {
    const auto [b1, b2] = numerators[static_cast<std::size_t>(i)];
    const auto [a1, a2] = denominators[static_cast<std::size_t>(i)];
    theta[1 + 4 * i] = b1;
    theta[2 + 4 * i] = b2;
    set_denominator(theta, i, a1, a2);
  }
  return theta;
}

Eigen::MatrixXd Biquads::second_order_sections(std::span<const double> theta) const {
  Eigen::MatrixXd rows(sections_, 6);
  for (Index i = 0; i < sections_; ++i) {
    const Section<double> s = section(theta, static_cast<std::size_t>(i));
    rows.row(i) << 1.0, s.b1, s.b2, 1.0, s.a1, s.a2;
  }
  rows.row(0).head<3>() *= theta[0];
  return rows;
}

}  // namespace blockid
