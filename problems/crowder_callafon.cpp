#include <blockid/problems/crowder_callafon.hpp>

#include <numbers>

namespace blockid::problems {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

}  // namespace

Polynomials CrowderCallafon::plant() const { return {Vector2d(0.0, sample_time_s), Vector2d(1.0, -1.0)}; }

Polynomials CrowderCallafon::model() const { return {Vector2d(0.0, (1.0 - pole()) / eps), Vector2d(1.0, -pole())}; }

Polynomials CrowderCallafon::controller() const {
  return {Vector2d(1.0 + sample_time_s / 2.0, -1.0 + sample_time_s / 2.0), Vector2d(1.0, -1.0)};
}

Polynomials CrowderCallafon::weight(double k) const {
  constexpr double kPole = 0.82;
  return {Eigen::VectorXd::Constant(1, k * (1.0 - kPole) * (1.0 - kPole)), Vector3d(1.0, -2.0 * kPole, kPole * kPole)};
}

double uniform(std::mt19937& generator) {
  const double high = static_cast<double>(generator() >> 5U);
  const double low = static_cast<double>(generator() >> 6U);
  return (high * 67108864.0 + low) / 9007199254740992.0;
}

Eigen::VectorXd crowder_reference(Eigen::Index count, std::uint32_t seed) {
  std::mt19937 generator(seed);
  Eigen::VectorXd r(count);
  for (Eigen::Index t = 0; t < count; t += 2) {
    const double u1 = uniform(generator);
    const double u2 = uniform(generator);
    const double radius = std::sqrt(-2.0 * std::log(1.0 - u1));
    r[t] = radius * std::cos(2.0 * std::numbers::pi * u2);
    if (t + 1 < count) r[t + 1] = radius * std::sin(2.0 * std::numbers::pi * u2);
  }
  return r;
}

}  // namespace blockid::problems
