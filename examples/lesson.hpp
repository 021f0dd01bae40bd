// What the lessons share: noise that is the same at every run, and checks that decide the exit code.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <iostream>
#include <random>
#include <string>

namespace lesson {

/// n independent N(0, deviation^2) numbers, (n,).
inline Eigen::VectorXd noise(Eigen::Index n, double deviation, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> gaussian(0.0, deviation);
  return Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index) { return gaussian(engine); });
}

/// Collects what a lesson promises.
class Checks {
 public:
  void expect(bool held, const std::string& what) {
    std::cout << (held ? "ok      " : "FAILED  ") << what << '\n';
    failed_ = failed_ || !held;
  }

  /// 0 when all held, 1 otherwise.
  int exit_code() const { return failed_ ? 1 : 0; }

 private:
  bool failed_ = false;
};

}  // namespace lesson
