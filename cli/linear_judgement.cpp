#include <blockid/cli/linear_outcome.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/row_major.hpp>
#include <blockid/estimators/prediction_error.hpp>

#include <utility>

namespace blockid::cli {
namespace {

using detail::RowMajor;

/// Prediction errors beside the simulation, which depends on the input alone, as the instruments must; and what errors
/// of the parameters add to them.
std::vector<ResidualRecord> residual_records(const PolynomialModel& model, const DataSet& data,
                                             const PredictionOptions& prediction, bool fitted_here) {
  const PredictionError function(model.orders, data, prediction, model.u_mean, model.y_mean);
  const Eigen::VectorXd p = function.with_fitted_states(model.theta);
  Eigen::VectorXd r(function.sample_count());
  RowMajor jacobian(function.sample_count(), p.size());
  if (!function.jacobian(p, r.data(), jacobian.data())) fail("residuals: the predictions of the model are not finite");
  const Index parameters = model.theta.size();
  std::vector<ResidualRecord> result;
  Index begin = 0;
  for (std::size_t i = 0; i < data.records.size(); ++i) {
    const Record& record = data.records[i];
    const Index n = record.u.size();
    ResidualRecord one;
    one.u = record.u;
    one.yhat = predict(model, record, kSimulation, prediction);
    const Eigen::VectorXd e = function.errors(p, static_cast<Index>(i));
    Eigen::VectorXd inverse = Eigen::VectorXd::Zero(n);
    one.weights = Eigen::VectorXd::Zero(n);
    for (Index t = prediction.warmup; t < n; ++t) {
      if (is_missing(record, t) || std::isnan(e[t])) continue;
      one.weights[t] = weight(record, t);
      inverse[t] = 1.0 / one.weights[t];
    }
    one.residual = (one.weights.array() > 0.0).select(e, 0.0);
    const Eigen::MatrixXd sensitivity = -(inverse.asDiagonal() * jacobian.middleRows(begin, n));
    one.fitted_here = fitted_here ? sensitivity : Eigen::MatrixXd(sensitivity.rightCols(p.size() - parameters));
    one.fitted_elsewhere = fitted_here ? Eigen::MatrixXd(n, 0) : Eigen::MatrixXd(sensitivity.leftCols(parameters));
    result.push_back(std::move(one));
    begin += n;
  }
  return result;
}

}  // namespace

Judgement judge(const PolynomialFit& fit, const DataSet& training, const DataSet& test,
                const PredictionOptions& prediction) {
  Judgement result;
  const ResidualTests of_training = residual_tests(residual_records(fit.model, training, prediction, true));
  if (test.records.empty()) {
    result.set = "training";
    result.parameters = "fitted to these records: the directions that they have used up are not tested";
    result.tests = of_training;
  } else {
    ResidualTestOptions options;
    const Index parameters = fit.model.theta.size();
    options.covariance = fit.covariance
                             ? Eigen::MatrixXd(fit.covariance->parameters.topLeftCorner(parameters, parameters))
                             : Eigen::MatrixXd::Zero(parameters, parameters);
    result.set = "test";
    result.parameters = "fitted to the training data; their covariance there is part of the bands";
    result.tests = residual_tests(residual_records(fit.model, test, prediction, false), options);
    result.errors = compare_errors(of_training, result.tests);
  }
  result.under_fit = under_fit_hints(result.tests);
  const ResidualTest* const whiteness = result.tests.find(ResidualTestKind::whiteness);
  if (whiteness != nullptr && !whiteness->passed) {
    result.under_fit.emplace_back(
        "whiteness: one step ahead more can be foretold; the model of the noise is too small");
  }
  return result;
}

}  // namespace blockid::cli
