#include <blockid/problems/janiszowski.hpp>

#include <blockid/data/error.hpp>
#include <blockid/problems/gaussian.hpp>

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

#include <cmath>
#include <numbers>
#include <random>

namespace blockid::problems {
namespace {

constexpr double kAmplitude = 7.814;
constexpr double kFirstHz = 4.12;
constexpr double kLastHz = 16.53;
constexpr double kLength = 2.5;
constexpr double kDriftShare = 0.46;
constexpr double kMicrometres = 1e3;

Eigen::VectorXd chirp(Eigen::Index n, double sample_time_s) {
  return Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index k) {
    const double t = static_cast<double>(k) * sample_time_s;
    const double cycles = kFirstHz * t + (kLastHz - kFirstHz) * t * t / (2.0 * kLength);
    return kAmplitude * std::sin(2.0 * std::numbers::pi * cycles);
  });
}

/// (n,) random walk whose largest excursion is one.
Eigen::VectorXd unit_walk(Eigen::Index n, Gaussian& gaussian) {
  Eigen::VectorXd walk(n);
  double sum = 0.0;
  for (double& value : walk) value = sum += gaussian();
  return walk / walk.cwiseAbs().maxCoeff();
}

Eigen::VectorXd measured(const Eigen::VectorXd& position_um, const ServoConditions& conditions) {
  Gaussian gaussian(conditions.seed);
  std::mt19937_64 engine(conditions.seed + 0x9e3779b97f4a7c15ULL);
  const Eigen::VectorXd drift = kDriftShare * conditions.drift_um * unit_walk(position_um.size(), gaussian);
  return Eigen::VectorXd::NullaryExpr(position_um.size(), [&](Eigen::Index k) {
    const double uniform = 0x1.0p-53 * static_cast<double>(engine() >> 11);
    const double disturbed = position_um[k] + drift[k] + conditions.noise_um * (uniform - 0.5);
    if (conditions.resolution_um == 0.0) return disturbed;
    return conditions.resolution_um * std::round(disturbed / conditions.resolution_um);
  });
}

}  // namespace

ServoMotion servo_response(const Eigen::VectorXd& u, double sample_time_s) {
  // States position, velocity, acceleration and the held input.
  Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
  generator(0, 1) = 1.0;
  generator(1, 2) = 1.0;
  generator.row(2) << 0.0, -ServoPlant::kA0, -ServoPlant::kA1, ServoPlant::kB0;
  const Eigen::Matrix4d step = (generator * sample_time_s).exp();
  ServoMotion motion{Eigen::VectorXd(u.size()), Eigen::VectorXd(u.size())};
  Eigen::Vector4d state = Eigen::Vector4d::Zero();
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    motion.position_mm[k] = state[0];
    motion.velocity_mm_s[k] = state[1];
    state[3] = u[k];
    state = (step * state).eval();
  }
  return motion;
}

Eigen::VectorXd two_tones(Eigen::Index n, double sample_time_s, double amplitude) {
  return Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index k) {
    const double phase = 2.0 * std::numbers::pi * 4.0 * static_cast<double>(k) * sample_time_s;
    return amplitude * (std::sin(phase) + 2.0 * std::sin(3.0 * phase));
  });
}

Record servo_record(const ServoConditions& conditions) {
  const double D = conditions.sample_time_s;
  if (!(D > 0.0 && D < kLength / 10.0)) fail("servo: expected a sample time in (0, 0.25) s, got ", D);
  if (!(conditions.drift_um >= 0.0 && conditions.noise_um >= 0.0 && conditions.resolution_um >= 0.0)) {
    fail("servo: expected drift, noise and resolution of at least 0 um, got ", conditions.drift_um, ", ",
         conditions.noise_um, " and ", conditions.resolution_um);
  }
  const Eigen::Index n = static_cast<Eigen::Index>(std::llround(kLength / D));
  Record record;
  record.name = "servo";
  record.sample_time_s = D;
  record.u = chirp(n, D);
  record.output_unit = "mm/s";
  const Eigen::VectorXd x = measured(kMicrometres * servo_response(record.u, D).position_mm, conditions) / kMicrometres;
  record.y = Eigen::VectorXd::Zero(n);
  record.weights = Eigen::VectorXd::Ones(n);
  record.y.segment(2, n - 4) = (x.tail(n - 4) + x.segment(3, n - 4) - x.segment(1, n - 4) - x.head(n - 4)) / (6.0 * D);
  record.weights.head(2).setZero();
  record.weights.tail(2).setZero();
  return record;
}

}  // namespace blockid::problems
