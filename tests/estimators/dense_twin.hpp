// The predictor written a second time: whole records, one pass, derivatives by Jets.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/predictor.hpp>

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace blockid::testing {

// Outputs aligned with the record, (N,). p: all unknowns.
template <class T>
std::vector<T> dense_prediction(const AnyBlock& chain, const Record& record, std::size_t place,
                                const PredictionOptions& options, const std::vector<T>& p) {
  const auto n_theta = static_cast<std::size_t>(chain.parameter_count());
  const auto n_x = static_cast<std::size_t>(chain.state_count());
  const std::vector<T> theta(p.begin(), p.begin() + chain.parameter_count());
  std::vector<T> x(n_x, T(0.0));
  if (options.initial_state == InitialState::estimated) {
    for (std::size_t j = 0; j < n_x; ++j) x[j] = p[n_theta + place * n_x + j];
  }
  const bool periodic = options.initial_state == InitialState::periodic;
  const Index run_in = periodic ? options.run_in_periods * record.period : 0;
  const Index samples = record.u.size();
  std::vector<T> u;
  for (Index t = -run_in; t < samples + chain.latency(); ++t) {
    if (periodic) {
      u.push_back(T(record.u[((t % record.period) + record.period) % record.period]));
    } else {
      u.push_back(T(t < samples ? record.u[t] : 0.0));
    }
  }
  std::vector<T> y(u.size());
  chain.apply(std::span<const T>(theta), std::span<T>(x), std::span<const T>(u), std::span<T>(y));
  y.erase(y.begin(), y.begin() + run_in + chain.latency());
  return y;
}

struct Dense {
  Eigen::VectorXd r;
  Eigen::MatrixXd jacobian;
};

// r and dr/dp over all records.
inline Dense dense_residuals(const AnyBlock& chain, const DataSet& data, const PredictionOptions& options,
                             const Eigen::VectorXd& p) {
  Index samples = 0;
  for (const Record& record : data.records) samples += record.u.size();
  Dense dense{Eigen::VectorXd::Zero(samples), Eigen::MatrixXd::Zero(samples, p.size())};
  for (Index first = 0; first < std::max<Index>(p.size(), 1); first += kJetStride) {
    std::vector<TileJet> jets;
    for (Index k = 0; k < p.size(); ++k) {
      const bool here = k >= first && k < first + kJetStride;
      jets.push_back(here ? TileJet(p[k], static_cast<int>(k - first)) : TileJet(p[k]));
    }
    Index row = 0;
    for (std::size_t i = 0; i < data.records.size(); ++i) {
      const Record& record = data.records[i];
      const std::vector<TileJet> yhat = dense_prediction(chain, record, i, options, jets);
      for (Index t = 0; t < record.u.size(); ++t, ++row) {
        const double w = t < options.warmup ? 0.0 : (record.weights.size() > 0 ? record.weights[t] : 1.0);
        if (w == 0.0) continue;
        dense.r[row] = w * (record.y[t] - yhat[static_cast<std::size_t>(t)].a);
        for (Index k = first; k < std::min(first + kJetStride, p.size()); ++k) {
          dense.jacobian(row, k) = -w * yhat[static_cast<std::size_t>(t)].v[static_cast<int>(k - first)];
        }
      }
    }
  }
  return dense;
}

}  // namespace blockid::testing
