// A model that runs along with its input: pieces of any length, or one sample at a time.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/text.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <exception>
#include <iostream>
#include <span>

namespace {

int run() {
  using namespace blockid;
  Model model = make_model(parse("G1=rational(nb=1,na=2) | f=saturation | G2=rational(nb=0,na=1)"), 1e-3);
  model.parameters.resize(8);
  model.parameters << 0.2, 0.1, -1.3, 0.5,  // G1: b0 b1 a1 a2
      -0.8, 1.0,                            // f: lower, upper
      0.3, -0.7;                            // G2: b0 a1
  const Eigen::VectorXd u = lesson::noise(1000, 1.0, 1);
  const Eigen::VectorXd whole = simulate(model, u);
  lesson::Checks checks;

  // begin: pieces
  Simulator simulator(model);
  Eigen::VectorXd yhat(u.size());
  for (std::size_t begin = 0; begin < 1000; begin += 64) {
    const std::size_t length = std::min<std::size_t>(64, 1000 - begin);
    simulator.push(std::span(u.data() + begin, length), std::span(yhat.data() + begin, length));
  }
  // end: pieces
  checks.expect((yhat - whole).cwiseAbs().maxCoeff() < 1e-13, "pieces of 64 samples give what the whole record gives");

  // begin: samples
  simulator.reset();
  for (Eigen::Index t = 0; t < u.size(); ++t) yhat[t] = simulator.step(u[t]);
  // end: samples
  checks.expect((yhat - whole).cwiseAbs().maxCoeff() < 1e-13, "so does one sample at a time");
  std::cout << "last output " << yhat[999] << '\n';
  return checks.exit_code();
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
