// A block of one's own in a chain with a library block, against the installed package alone.
#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <span>

namespace {

// x_{t+1} = a x_t + tanh(b u_t), y_t = x_{t+1}; theta = [a, b].
struct SaturatingLag {
  blockid::Index parameter_count() const { return 2; }
  blockid::Index state_count() const { return 1; }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) {
      x[0] = theta[0] * x[0] + tanh(theta[1] * u[t]);
      y[t] = x[0];
    }
  }
};

void require(bool condition, const char* what) {
  if (!condition) {
    std::cerr << "failed: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

void simulates_as_the_equations_say() {
  blockid::Model model =
      blockid::make_model(blockid::Series({{"G", blockid::Rational(0, 1)}, {"lag", SaturatingLag{}}}));
  require(model.parameters.size() == 4, "parameters of both blocks");
  model.parameters << 2.0, -0.5, 0.25, 0.75;  // b0, a1, a, b

  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(50, -1.0, 1.0);
  const Eigen::VectorXd y = blockid::simulate(model, u);

  double v = 0.0;
  double x = 0.0;
  for (Eigen::Index t = 0; t < u.size(); ++t) {
    v = 2.0 * u[t] + 0.5 * v;
    x = 0.25 * x + std::tanh(0.75 * v);
    require(std::abs(y[t] - x) < 1e-12, "simulated output");
  }
}

void mistakes_throw() {
  try {
    blockid::Rational(-1, 0);
  } catch (const blockid::Error&) {
    return;
  }
  require(false, "Error for a negative order");
}

}  // namespace

int main() {
  simulates_as_the_equations_say();
  mistakes_throw();
  std::cout << "all passed\n";
}
