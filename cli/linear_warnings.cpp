#include <blockid/cli/linear_outcome.hpp>

#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/excitation.hpp>
#include <blockid/init/root_groups.hpp>

#include <algorithm>
#include <cmath>
#include <complex>

namespace blockid::cli {
namespace {

struct Modulus {
  double value = 0.0;
  double deviation = 0.0;
};

/// |z| of a root of z^n + a_1 z^{n-1} + ... + a_n: dz/da_k = -z^{n-k} / A'(z).
Modulus uncertain(std::complex<double> z, const Eigen::VectorXd& a, const Eigen::MatrixXd& covariance) {
  const Index n = a.size() - 1;
  std::complex<double> slope = 0.0;
  for (Index k = 0; k < n; ++k) slope += static_cast<double>(n - k) * a[k] * std::pow(z, n - k - 1);
  Eigen::VectorXd gradient(n);
  for (Index k = 1; k <= n; ++k) gradient[k - 1] = -(std::conj(z) * std::pow(z, n - k) / slope).real() / std::abs(z);
  return {std::abs(z), std::sqrt(gradient.dot(covariance.topLeftCorner(n, n) * gradient))};
}

/// The largest pole that least squares see outside the circle, beyond doubt; zero when there is none.
double pole_outside(const PolynomialFit& arx) {
  constexpr double kBeyondDoubt = 4.0;  // deviations
  if (!arx.covariance || arx.covariance->rank < arx.covariance->free_count) return 0.0;
  const Eigen::VectorXd a = polynomials(arx.model).a;
  double largest = 0.0;
  for (const std::complex<double> z : roots(root_groups(a))) {
    const Modulus modulus = uncertain(z, a, arx.covariance->parameters);
    if (modulus.value - kBeyondDoubt * modulus.deviation > 1.0) largest = std::max(largest, modulus.value);
  }
  return largest;
}

}  // namespace

std::vector<std::string> warnings_of(const PolynomialFit& fit) {
  std::vector<std::string> warnings;
  if (!is_stable(fit.model)) {
    warnings.emplace_back(
        "the path from input to output is not stable: a root of A or F is not inside the circle, and its simulation "
        "diverges; the errors one step ahead are what tells how good the model is");
  }
  if (!has_stationary_noise(fit.model)) {
    warnings.emplace_back("the noise is not stationary: a root of A or D is not inside the circle");
  }
  if (!has_stable_predictor(fit.model)) {
    warnings.emplace_back("the predictor does not forget its start: a root of C or F is not inside the circle");
  }
  if (fit.covariance && !fit.covariance->undetermined.empty()) {
    warnings.push_back("the data do not determine " + joined(fit.covariance->undetermined) + ": take lower orders");
  }
  if (fit.status == FitStatus::diverged || fit.status == FitStatus::max_iterations) {
    warnings.push_back("the fit has not converged (" + blockid::to_text(fit.status) + "): " + fit.message);
  }
  return warnings;
}

std::string warning_of_unstable_system(const PolynomialOrders& orders, const DataSet& data,
                                       const PredictionOptions& prediction) {
  if (orders.nf == 0) return {};
  constexpr Index kMore = 2;
  const Index order = orders.nf + std::max(orders.nc, orders.nd) + kMore;
  PolynomialFitOptions options;
  options.prediction = prediction;
  double modulus = 0.0;
  try {
    modulus = pole_outside(identify_polynomial(data, {.na = order, .nb = order, .nk = orders.nk}, options).fit);
  } catch (const Error&) {
    return {};  // too few samples for so many coefficients: nothing is known
  }
  if (modulus == 0.0) return {};
  return "the system seems to be unstable: a least-squares model (arx na=" + std::to_string(order) +
         " nb=" + std::to_string(order) + ") has a pole of modulus " + number(modulus, 4) +
         "; oe and bj predict by simulation and do not find such a pole, take arx or armax";
}

std::string warning_of_excitation(const PolynomialOrders& orders, const DataSet& data) {
  Excitation excited = excitation(data);
  excited.mean = false;
  return text_of_lack(excited, orders.nb + 1 + orders.nf);
}

}  // namespace blockid::cli
