#include <blockid/estimators/continuous_fit.hpp>

#include <blockid/blocks/detail/hold.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/estimators/detail/held_states.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <cmath>
#include <limits>
#include <utility>

namespace blockid {
namespace {

using detail::RowMajor;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// (N, n) [c e^{At} e_k]: what each initial state adds to the output. Impulse responses of the filter bank, which are
/// of like size whatever the band, rather than the states one by one.
RowMajor free_responses(const StateSpace& system, double sample_time_s, Index count) {
  const Index n = system.a.rows();
  const MatrixXd transition = detail::matrix_exponential(system.a * sample_time_s);
  VectorXd impulse = system.b;
  RowMajor rows(count, n);
  for (Index t = 0; t < count; ++t) {
    rows.row(t) = impulse.transpose();
    impulse = (transition * impulse).eval();
  }
  return rows;
}

/// y plus the combination of free responses that brings it nearest to the record.
VectorXd with_initial_state(VectorXd y, const StateSpace& system, const Record& record, Index warmup) {
  const Index n = system.a.rows();
  const RowMajor free = free_responses(system, record.sample_time_s, y.size());
  if (!free.allFinite() || !y.allFinite()) return y;
  RowMajor rows(y.size(), n + 1);
  Index counted = 0;
  for (Index t = warmup; t < y.size(); ++t) {
    if (is_missing(record, t)) continue;
    rows.row(counted) << free.row(t), record.y[t] - y[t];
    rows.row(counted++) *= weight(record, t);
  }
  if (counted < n) {
    fail("simulation: expected at least ", n, " output samples for the initial state of ", describe(record), ", got ",
         counted);
  }
  QrTriangle triangle(n + 1);
  triangle.add(rows.data(), counted, rows.cols());
  return y + free * solve_least_squares(triangle).x;
}

}  // namespace

VectorXd simulate(const ContinuousTransferFunction& model, const Record& record, const ContinuousSimulation& options) {
  check(record);
  const bool periodic = options.initial_state == InitialState::periodic;
  if (periodic && record.period <= 0) {
    fail("simulation: a periodic initial state needs the period of ", describe(record), ", got ", record.period);
  }
  if (options.warmup < 0 || options.warmup >= record.u.size()) {
    fail("simulation: expected a warm-up from 0 to less than the ", record.u.size(), " samples of ", describe(record),
         ", got ", options.warmup);
  }
  const Index period = periodic ? record.period : 0;
  const StateSpace system = state_space(model);
  const detail::HeldSignal input = detail::held_signal(record.u, options.hold, period);
  detail::HeldStates states(system.a, system.b, input, record.sample_time_s, period);
  VectorXd y(record.u.size());
  for (Index t = 0; t < y.size(); ++t) {
    y[t] = system.c.dot(states.state()) + system.d * record.u[t];
    if (t + 1 < y.size()) states.step();
  }
  if (options.initial_state != InitialState::estimated) return y;
  return with_initial_state(std::move(y), system, record, options.warmup);
}

SimulationErrors simulation_errors(const ContinuousTransferFunction& model, const DataSet& data,
                                   const ContinuousFitOptions& options) {
  SimulationErrors sums;
  for (const Record& record : data.records) {
    const VectorXd y = simulate(model, record, {options.input_hold, options.initial_state, options.warmup});
    for (Index t = options.warmup; t < y.size(); ++t) {
      if (is_missing(record, t)) continue;
      const double error = weight(record, t) * (record.y[t] - y[t]);
      sums.squared += error * error;
      sums.absolute += std::abs(error);
      ++sums.samples;
    }
  }
  if (!std::isfinite(sums.squared)) sums.squared = sums.absolute = std::numeric_limits<double>::infinity();
  return sums;
}

double simulation_rms(const ContinuousTransferFunction& model, const DataSet& data,
                      const ContinuousFitOptions& options) {
  const SimulationErrors sums = simulation_errors(model, data, options);
  const double rms = std::sqrt(sums.squared / static_cast<double>(sums.samples));
  return std::isfinite(rms) ? rms : std::numeric_limits<double>::infinity();
}

}  // namespace blockid
