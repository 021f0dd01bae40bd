// Random signals that are the same with every standard library.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace blockid::testing {

// Independent standard normal numbers (Box and Muller 1958) from a Mersenne twister.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : engine_(seed) {}

  // In (0, 1].
  double uniform() { return 0x1.0p-53 * (static_cast<double>(engine_() >> 11) + 1.0); }

  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

  // (n,) white, normal.
  Eigen::VectorXd white(Eigen::Index n, double deviation = 1.0) {
    return Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index) { return deviation * normal(); });
  }

  // (n,) e_t = pole e_{t-1} + w_t with stationary deviation `deviation`.
  Eigen::VectorXd coloured(Eigen::Index n, double pole, double deviation) {
    Eigen::VectorXd e(n);
    double last = deviation * normal();
    const double drive = deviation * std::sqrt(1.0 - pole * pole);
    for (Eigen::Index t = 0; t < n; ++t) {
      e[t] = last;
      last = pole * last + drive * normal();
    }
    return e;
  }

  // (rows, columns) white, normal.
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&](Eigen::Index, Eigen::Index) { return normal(); });
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace blockid::testing
