// Systems of known parameters, and data simulated from them.
#pragma once

#include "support/signals.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/record.hpp>

#include <Eigen/Core>
#include <initializer_list>
#include <string_view>
#include <vector>

namespace blockid::testing {

// A model of the given text form; parameters in the order of the chain.
inline Model model_of(std::string_view text, std::initializer_list<double> parameters) {
  Model model = make_model(parse(text));
  model.parameters = Eigen::Map<const Eigen::VectorXd>(parameters.begin(), static_cast<Index>(parameters.size()));
  check(model);
  return model;
}

// The largest numerator coefficients are 1, as normalise() makes them. Poles 0.6 +- 0.4i and 0.5, 0.4; Chebyshev
// coefficients of the polynomial on [-4, 4].
inline Model wiener_hammerstein() {
  return model_of("G1=rational(nb=2,na=2) | f=polynomial(degree=3,range=[-4:4]) | G2=rational(nb=1,na=2)",
                  {1.0, 0.4, 0.2, -1.2, 0.52, 0.5, 3.0, 0.4, -0.5, 1.0, -0.3, -0.9, 0.2});
}

inline Model wiener() {
  return model_of("G=rational(nb=1,na=2) | f=polynomial(degree=3,range=[-4:4])",
                  {1.0, 0.5, -1.1, 0.4, 0.3, 2.5, 0.6, -0.4});
}

inline Model hammerstein() {
  return model_of("f=polynomial(degree=3,range=[-4:4]) | G=rational(nb=1,na=2)",
                  {0.2, 2.0, 0.7, 0.5, 1.0, 0.6, -1.2, 0.5});
}

inline Model linear() { return model_of("G=rational(nb=2,na=2)", {0.8, 0.4, -0.3, -1.3, 0.6}); }

// Two branches that share no dynamics; the second passes through no constant of its own, which the first one's takes
// up.
inline Model parallel_branches() {
  return model_of(
      "[A=rational(nb=1,na=1) | f=polynomial(degree=2,range=[-3:3])"
      " + Q=polynomial(degree=2,range=[-3:3]) | B=rational(nb=0,na=2)]",
      {1.0, 0.3, -0.8, 0.4, 1.5, 0.5, 0.0, -1.0, 0.6, 1.0, 0.5, 0.3});
}

// White Gaussian input of unit deviation and the model's output with white noise.
inline Record simulated_record(const Model& model, Index samples, double noise, std::uint64_t seed) {
  Noise numbers(seed);
  Record record;
  record.u = numbers.white(samples);
  record.y = simulate(model, record.u) + numbers.white(samples, noise);
  record.sample_time_s = model.sample_time_s;
  return record;
}

// The parameters with each of `free` moved by up to `share` of its size (0.1 where it is small).
inline Eigen::VectorXd moved(const Eigen::VectorXd& theta, const std::vector<Index>& free, double share,
                             std::uint64_t seed) {
  Noise numbers(seed);
  Eigen::VectorXd result = theta;
  for (const Index k : free) {
    result[k] += share * std::max(0.1, std::abs(theta[k])) * (2.0 * numbers.uniform() - 1.0);
  }
  return result;
}

}  // namespace blockid::testing
