#include <blockid/data/error.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/init/noise_test.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace blockid {
namespace {

/// Samples for each lag at least: three regressors a lag leave nineteen in twenty degrees of freedom.
constexpr Index kSamplesPerLag = 60;
/// Rows of a tile are padded to a multiple of this.
constexpr Index kPadding = 8;

/// Quantile 1 - level of the standard normal distribution, by bisection of erfc.
double normal_quantile(double level) {
  double lower = -40.0;
  double upper = 40.0;
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (lower + upper);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > level ? lower : upper) = middle;
  }
  return 0.5 * (lower + upper);
}

/// Quantile 1 - level of chi-squared; Wilson and Hilferty 1931.
double chi_squared_quantile(double degrees, double level) {
  const double part = 2.0 / (9.0 * degrees);
  const double root = 1.0 - part + normal_quantile(level) * std::sqrt(part);
  return degrees * root * root * root;
}

/// The row of sample t: [1, past of r, past of u, past of u^2, r_t].
void fill_row(const double* r, const Eigen::VectorXd& u, Index t, Index lags, std::vector<double>& row) {
  row[0] = 1.0;
  for (Index k = 0; k < lags; ++k) {
    row[static_cast<std::size_t>(1 + k)] = r[t - 1 - k];
    row[static_cast<std::size_t>(1 + lags + k)] = u[t - k];
    row[static_cast<std::size_t>(1 + 2 * lags + k)] = u[t - k] * u[t - k];
  }
  row[static_cast<std::size_t>(1 + 3 * lags)] = r[t];
}

}  // namespace

NoiseTest noise_test(const Predictor& predictor, const Eigen::VectorXd& p, const NoiseTestOptions& options) {
  if (options.lags < 1 || !(options.level > 0.0) || !(options.level < 1.0)) {
    fail("noise_test: expected lags >= 1 and a level within (0, 1), got ", options.lags, " and ", options.level);
  }
  const Index lags = std::min(options.lags, predictor.counted_samples() / kSamplesPerLag);
  std::vector<double> residuals(static_cast<std::size_t>(predictor.sample_count()));
  if (!predictor.residuals(p, residuals.data())) return {std::numeric_limits<double>::infinity(), 0.0};
  if (lags < 1) return {};
  const Index columns = 3 * lags + 2;
  NormalEquations sums(columns);
  std::vector<double> row(static_cast<std::size_t>((columns + kPadding - 1) / kPadding * kPadding), 0.0);
  const double* r = residuals.data();
  for (const Record& record : predictor.data().records) {
    for (Index t = predictor.options().warmup + lags; t < record.u.size(); ++t) {
      if (record.weights.size() > 0 && !(record.weights[t] > 0.0)) continue;
      fill_row(r, record.u, t, lags, row);
      sums.add(row.data(), 1, std::ssize(row));
    }
    r += record.u.size();
  }
  const Eigen::MatrixXd gram = sums.gram();
  const double total = gram(columns - 1, columns - 1);
  if (!(total > 0.0)) return {};
  const LinearSolution fitted = solve_least_squares(gram);
  const double explained = 1.0 - fitted.residual_sum_of_squares / total;
  return {static_cast<double>(sums.rows()) * explained,
          chi_squared_quantile(static_cast<double>(fitted.rank), options.level)};
}

}  // namespace blockid
