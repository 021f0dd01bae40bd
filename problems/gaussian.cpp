#include <blockid/problems/gaussian.hpp>

#include <cmath>
#include <numbers>

namespace blockid::problems {

double Gaussian::uniform() {
  constexpr int kDroppedBits = 11;
  constexpr double kUnit = 0x1.0p-53;
  return (static_cast<double>(engine_() >> kDroppedBits) + 1.0) * kUnit;
}

double Gaussian::operator()() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  const double angle = 2.0 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

Eigen::VectorXd Gaussian::vector(Eigen::Index n) {
  Eigen::VectorXd result(n);
  for (double& value : result) value = (*this)();
  return result;
}

}  // namespace blockid::problems
