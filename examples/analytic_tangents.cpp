// A block with derivatives written by hand, and the other members that a block may have.
#include "lesson.hpp"

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/blocks/registry.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/testing/block_conformance.hpp>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <exception>
#include <iostream>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace {

// begin: block
/// y = a tanh(b u), theta = [a, b].
struct SoftSaturation {
  std::string kind() const { return "soft_saturation"; }
  blockid::Index parameter_count() const { return 2; }
  std::vector<std::string> parameter_names() const { return {"a", "b"}; }
  Eigen::VectorXd initial_parameters() const { return Eigen::Vector2d(1.0, 1.0); }
  blockid::ParameterBounds bounds() const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {Eigen::Vector2d(-kInfinity, 0.0), Eigen::Vector2d(kInfinity, kInfinity)};  // b >= 0
  }

  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * tanh(theta[1] * u[t]);
  }

  /// No state, hence nothing to remember from tile to tile.
  blockid::Index tangent_memory(blockid::Index, blockid::OwnColumns) const { return 0; }

  void push_forward(std::span<const double> theta, std::span<double>, std::span<double>, std::span<const double> u,
                    std::span<double> y, const blockid::Tangents& tangents, blockid::OwnColumns) const {
    for (blockid::Index t = 0; t < tangents.rows; ++t) {
      const double input = u[static_cast<std::size_t>(t)];
      const double h = std::tanh(theta[1] * input);
      const double slope = theta[0] * (1.0 - h * h);  // dy / d(b u)
      y[static_cast<std::size_t>(t)] = theta[0] * h;
      double* const row = tangents.row(t);
      for (blockid::Index k = 0; k < tangents.upstream; ++k) row[k] *= slope * theta[1];  // du/dp -> dy/dp
      double* const own = tangents.own(t);
      own[0] = h;              // dy/da
      own[1] = slope * input;  // dy/db
    }
  }
};
// end: block

// begin: registry
/// The library's kinds and ours: for text forms and model files.
blockid::Registry registry_with_soft_saturation() {
  blockid::Registry registry = blockid::standard_registry();
  registry.add("soft_saturation", {}, [](const blockid::BlockArguments&) { return SoftSaturation{}; });
  return registry;
}
// end: registry

int run() {
  using namespace blockid;
  lesson::Checks checks;
  const testing::ConformanceReport report = testing::check_block(SoftSaturation{});
  std::cout << report.text() << '\n';
  checks.expect(report.ok(), "tangents agree with Jets and with differences, and all other laws hold");

  Model truth = make_model(parse("G=rational(nb=0,na=1) | f=soft_saturation", registry_with_soft_saturation()));
  truth.parameters = Eigen::Vector4d(1.0, -0.8, 2.0, 0.5);  // G: b0, a1; f: a, b
  Record record;
  record.u = lesson::noise(2000, 1.0, 1);
  record.y = simulate(truth, record.u) + lesson::noise(2000, 0.01, 2);
  Model start = make_model(truth.chain);
  RefitOptions options;
  options.frozen = {"G.b0"};  // its gain could be traded with b
  const RefitReport fitted = refit(start, record, options);
  std::cout << fitted.model.parameters.transpose() << '\n';
  checks.expect((fitted.model.parameters - truth.parameters).cwiseAbs().maxCoeff() < 0.01,
                "the parameters are those of the system");
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
