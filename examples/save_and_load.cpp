// Models as files: exact round trip, also for chains with blocks of one's own.
#include "lesson.hpp"

#include <blockid/blocks/model.hpp>
#include <blockid/blocks/model_json.hpp>
#include <blockid/blocks/registry.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <exception>
#include <iomanip>
#include <iostream>
#include <span>
#include <sstream>
#include <string>

namespace {

// begin: kind
// y = tanh(gain u) with a fixed gain: structure, hence an argument of the text form.
struct SoftClip {
  double gain = 1.0;

  std::string kind() const { return "soft_clip"; }
  blockid::Arguments arguments() const {
    std::ostringstream digits;
    digits << std::setprecision(17) << gain;  // so many that the same number is read back
    return {{"gain", digits.str()}};
  }
  blockid::Index parameter_count() const { return 0; }
  template <class T>
  void apply(std::span<const T>, std::span<T>, std::span<const T> u, std::span<T> y) const {
    using std::tanh;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = tanh(gain * u[t]);
  }
};

blockid::Registry my_registry() {
  blockid::Registry registry = blockid::standard_registry();
  registry.add("soft_clip", {{"gain", "slope at the origin"}},
               [](const blockid::BlockArguments& arguments) { return SoftClip{arguments.number("gain")}; });
  return registry;
}
// end: kind

int run() {
  using namespace blockid;
  // begin: files
  const Registry registry = my_registry();
  Model model = make_model(parse("G=rational(nb=1,na=1) | f=soft_clip(gain=0.7)", registry), 1e-3);
  model.parameters = Eigen::Vector3d(1.0 / 3.0, 0.1, -0.9);
  save_model("model.json", model);
  const Model loaded = load_model("model.json", registry);
  // end: files

  std::cout << to_json(model);
  const Eigen::VectorXd u = lesson::noise(500, 1.0, 1);
  lesson::Checks checks;
  checks.expect(to_text(loaded.chain) == to_text(model.chain), "the chain is the same");
  checks.expect(loaded.parameters == model.parameters, "so is every bit of the parameters");
  checks.expect(simulate(loaded, u) == simulate(model, u), "and of the simulation");
  try {
    static_cast<void>(load_model("model.json"));
    checks.expect(false, "a registry without the kind refuses the file");
  } catch (const Error& error) {
    std::cout << error.what() << '\n';
    checks.expect(true, "a registry without the kind refuses the file");
  }
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
