#include <blockid/validation/model_residuals.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <algorithm>

namespace blockid {
namespace {

using detail::RowMajor;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Residuals and the derivatives by all unknowns of the predictor.
struct Linearised {
  VectorXd yhat;
  VectorXd residual;
  VectorXd weights;
  MatrixXd sensitivity;
};

std::vector<Linearised> linearised(const Model& model, const DataSet& data, const PredictionOptions& prediction,
                                   const std::vector<VectorXd>& states) {
  const Predictor predictor(model.chain, data, prediction);
  const bool estimated = prediction.initial_state == InitialState::estimated && model.chain.state_count() > 0;
  VectorXd p = VectorXd::Zero(predictor.unknown_count());
  p.head(model.parameters.size()) = model.parameters;
  if (estimated) {
    if (states.size() != data.records.size()) {
      fail("residuals: expected an initial state for each of ", data.records.size(), " records, got ", states.size());
    }
    Index begin = model.parameters.size();
    for (const VectorXd& state : states) {
      p.segment(begin, state.size()) = state;
      begin += state.size();
    }
  }
  VectorXd r(predictor.sample_count());
  RowMajor jacobian(predictor.sample_count(), p.size());
  if (!predictor.jacobian(p, r.data(), jacobian.data())) fail("residuals: the prediction of the model is not finite");

  std::vector<Linearised> result;
  Index begin = 0;
  for (std::size_t i = 0; i < data.records.size(); ++i) {
    const Record& record = data.records[i];
    const Index n = blockid::sample_count(record);
    Linearised part;
    part.weights = record.weights.size() > 0 ? record.weights : VectorXd::Ones(n);
    part.weights.head(std::min(prediction.warmup, n)).setZero();
    part.yhat = predictor.predict(p, static_cast<Index>(i));
    part.residual = (part.weights.array() > 0.0).select(record.y - part.yhat, 0.0);
    // Rows of the Jacobian are -w d yhat / dp.
    const VectorXd inverse = (part.weights.array() > 0.0).select(part.weights.cwiseInverse(), 0.0);
    part.sensitivity = -(inverse.asDiagonal() * jacobian.middleRows(begin, n));
    result.push_back(std::move(part));
    begin += n;
  }
  return result;
}

std::vector<Index> free_columns(Index parameters, const std::vector<Index>& held) {
  std::vector<Index> columns;
  for (Index k = 0; k < parameters; ++k) {
    if (!std::binary_search(held.begin(), held.end(), k)) columns.push_back(k);
  }
  return columns;
}

std::vector<ResidualRecord> residual_records(const Model& model, const DataSet& data,
                                             const PredictionOptions& prediction, const ParameterKnowledge& knowledge,
                                             bool theta_fitted_here) {
  const Index parameters = model.parameters.size();
  const std::vector<Index> theta = free_columns(parameters, knowledge.held);
  std::vector<ResidualRecord> records;
  const std::vector<Linearised> parts = linearised(model, data, prediction, knowledge.initial_states);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Linearised& part = parts[i];
    const Index states = part.sensitivity.cols() - parameters;
    ResidualRecord record{data.records[i].u, part.yhat, part.residual, part.weights, {}, {}};
    const MatrixXd of_theta = part.sensitivity(Eigen::all, theta);
    record.fitted_here.resize(part.yhat.size(), states + (theta_fitted_here ? of_theta.cols() : 0));
    record.fitted_here.leftCols(states) = part.sensitivity.rightCols(states);
    if (theta_fitted_here) {
      record.fitted_here.rightCols(of_theta.cols()) = of_theta;
    } else {
      record.fitted_elsewhere = of_theta;
    }
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace

std::vector<ResidualRecord> training_residuals(const Model& model, const DataSet& data,
                                               const PredictionOptions& prediction,
                                               const ParameterKnowledge& knowledge) {
  return residual_records(model, data, prediction, knowledge, true);
}

std::vector<ResidualRecord> test_residuals(const Model& model, const DataSet& data, const PredictionOptions& prediction,
                                           const ParameterKnowledge& knowledge) {
  return residual_records(model, data, prediction, knowledge, false);
}

}  // namespace blockid
