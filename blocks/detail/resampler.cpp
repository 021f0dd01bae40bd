#include <blockid/blocks/detail/resampler.hpp>

#include <blockid/blocks/detail/kernels.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace blockid::detail {
namespace {

/// Kaiser's rule for a stop band of -80 dB.
constexpr double kBeta = 0.1102 * (80.0 - 8.7);

/// Rows that one call of the kernel makes on the way up (at most) and down.
constexpr Index kUpGroup = 8;
constexpr Index kDownGroup = 4;

/// I_0(x) by its power series.
double bessel_i0(double x) {
  double term = 1.0;
  double sum = 1.0;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= (0.5 * x / k) * (0.5 * x / k);
    sum += term;
  }
  return sum;
}

double windowed_sinc(double t, double half_length) {
  if (t == 0.0) return 1.0;
  const double place = t / half_length;
  const double window = bessel_i0(kBeta * std::sqrt(std::max(0.0, 1.0 - place * place))) / bessel_i0(kBeta);
  return window * std::sin(std::numbers::pi * t) / (std::numbers::pi * t);
}

/// h at j = 0 .. H M; each phase of the even h adds up to one.
std::vector<double> make_taps(Index factor, Index half_length) {
  const Index last = factor * half_length;
  std::vector<double> taps(static_cast<std::size_t>(last + 1), 0.0);
  taps[0] = 1.0;
  const auto at = [&](Index j) -> double& { return taps[static_cast<std::size_t>(std::abs(j))]; };
  for (Index j = 1; j < last; ++j) {
    if (j % factor == 0) continue;
    at(j) = windowed_sinc(static_cast<double>(j) / static_cast<double>(factor), static_cast<double>(half_length));
  }
  // The phases r and M - r are mirror images: scaled together, h stays even.
  for (Index r = 1; 2 * r <= factor; ++r) {
    double sum = 0.0;
    for (Index j = r - last; j < last; j += factor) sum += at(j);
    for (Index j = 1; j < last; ++j) {
      if (j % factor == r || j % factor == factor - r) at(j) /= sum;
    }
  }
  return taps;
}

}  // namespace

Resampler::Resampler(Index factor, Index half_length)
    : factor_(factor), half_length_(half_length), taps_(make_taps(factor, half_length)) {
  for (Index first = 0; first < factor_; first += kUpGroup) {
    for (Index row = 0; row <= past(); ++row) {
      for (Index m = first; m < std::min(first + kUpGroup, factor_); ++m) {
        up_weights_.push_back(up_tap(m, past() - row));
      }
    }
  }
  const auto weight = [&](Index fine_row, Index output) {
    const Index k = past() - fine_row / factor_ + output;
    return k < 0 || k > past() ? 0.0 : down_tap(fine_row % factor_, k);
  };
  for (Index row = 0; row < (past() + kDownGroup) * factor_; ++row) {
    for (Index output = 0; output < kDownGroup; ++output) down_weights_.push_back(weight(row, output));
  }
  for (Index row = 0; row < (past() + 1) * factor_; ++row) down_single_.push_back(weight(row, 0));
}

double Resampler::tap(Index j) const {
  const Index place = std::abs(j);
  return place < std::ssize(taps_) ? taps_[static_cast<std::size_t>(place)] : 0.0;
}

double Resampler::response(double omega) const {
  double sum = taps_[0];
  for (std::size_t j = 1; j < taps_.size(); ++j) sum += 2.0 * taps_[j] * std::cos(omega * static_cast<double>(j));
  return sum;
}

void Resampler::up_rows(const double* window, Index stride, Index rows, double* fine, Index fine_stride,
                        Index columns) const {
  const auto mix_rows = kernels().mix_rows;
  for (Index n = 0; n < rows; ++n) {
    const double* weights = up_weights_.data();
    for (Index first = 0; first < factor_; first += kUpGroup) {
      const Index outputs = std::min(kUpGroup, factor_ - first);
      mix_rows(weights, past() + 1, outputs, window + n * stride, stride, fine + (n * factor_ + first) * fine_stride,
               fine_stride, columns);
      weights += (past() + 1) * outputs;
    }
  }
}

void Resampler::down_rows(const double* window, Index stride, Index rows, double* target, Index target_stride,
                          Index columns) const {
  const auto mix_rows = kernels().mix_rows;
  Index n = 0;
  for (; n + kDownGroup <= rows; n += kDownGroup) {
    mix_rows(down_weights_.data(), (past() + kDownGroup) * factor_, kDownGroup, window + n * factor_ * stride, stride,
             target + n * target_stride, target_stride, columns);
  }
  for (; n < rows; ++n) {
    mix_rows(down_single_.data(), (past() + 1) * factor_, 1, window + n * factor_ * stride, stride,
             target + n * target_stride, target_stride, columns);
  }
}

}  // namespace blockid::detail
