#include <blockid/estimators/detail/continuous_equation.hpp>

#include <blockid/blocks/detail/hold.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/row_major.hpp>

#include <algorithm>
#include <utility>

namespace blockid::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kTileRows = 256;
constexpr std::size_t kMostRuns = 64;

void check_options(const ContinuousFitOptions& options) {
  if (options.warmup < 0) fail("continuous fit: expected a warm-up of at least 0 samples, got ", options.warmup);
  if (options.max_iterations < 1) {
    fail("continuous fit: expected at least one iteration, got ", options.max_iterations);
  }
  if (!(options.tolerance > 0.0)) fail("continuous fit: expected a positive tolerance, got ", options.tolerance);
  const bool first_order = options.input_hold == Hold::first_order && options.output_hold == Hold::first_order;
  if (options.smoothed_regressand && !first_order) {
    fail("continuous fit: the smoothed regressand belongs to first-order hold of input and output, got ",
         to_text(options.input_hold), " and ", to_text(options.output_hold));
  }
}

void check_basis(const RationalBasis& basis) {
  check(basis);
  if (basis.kind == BasisKind::chebyshev) {
    fail("continuous fit: expected a basis of filters (flbf, monomial, laguerre, kautz), got ", to_text(basis.kind));
  }
}

/// (v_{t-1} + 10 v_t + v_{t+1}) / 12, (N,), the ends as they are: their rows do not count.
VectorXd smoothed(const VectorXd& v) {
  VectorXd result = v;
  for (Index t = 1; t + 1 < v.size(); ++t) result[t] = (v[t - 1] + 10.0 * v[t] + v[t + 1]) / 12.0;
  return result;
}

}  // namespace

/// The filter bank under 1/D and the columns that it makes.
struct ContinuousEquation::Filter {
  MatrixXd a;
  VectorXd b;
  /// (m + 1, n) and (m + 1,): [x_u, u - x_u d] T as outputs of the bank driven by u.
  MatrixXd outputs;
  VectorXd direct;
};

ContinuousEquation::ContinuousEquation(const DataSet& data, const RationalBasis& basis,
                                       const ContinuousFitOptions& options)
    : basis_(basis), options_(options) {
  check_options(options);
  check_basis(basis);
  check(data);
  check_excitation(data);
  numerator_map_ = numerator_map(basis);
  sample_time_s_ = data.records.front().sample_time_s;
  initial_each_ = options.initial_state == InitialState::estimated ? basis.order : 0;
  add_runs(data);
  for (const ContinuousRun& run : runs_) {
    for (Index t = 0; t < run.y.size(); ++t) rows_ += counts(run, t) ? 1 : 0;
  }
  if (rows_ < unknowns()) {
    fail("continuous fit: expected at least ", unknowns(), " samples that count for ", unknowns(),
         " unknowns (initial states included), got ", rows_);
  }
}

void ContinuousEquation::add_runs(const DataSet& data) {
  const bool periodic = options_.initial_state == InitialState::periodic;
  const Index degree = std::max(hold_pieces(options_.input_hold).degree(), hold_pieces(options_.output_hold).degree());
  const Index shortest = std::max(2 * degree + 2, initial_each_ + 1) + options_.warmup;
  for (Index r = 0; r < std::ssize(data.records); ++r) {
    const Record& record = data.records[static_cast<std::size_t>(r)];
    const Index count = record.u.size();
    if (periodic && record.period <= 0) {
      fail("continuous fit: a periodic initial state needs the period of ", describe(record), ", got ", record.period);
    }
    for (Index first = 0; first < count;) {
      if (is_missing(record, first)) {
        ++first;
        continue;
      }
      Index end = first;
      while (end < count && !is_missing(record, end)) ++end;
      if ((first > 0 || end < count) && periodic) {
        fail("continuous fit: a periodic initial state needs all output samples of ", describe(record), ", sample ",
             first > 0 ? first - 1 : end, " is missing");
      }
      if (first > 0 && options_.initial_state == InitialState::zero && options_.warmup == 0) {
        fail("continuous fit: ", describe(record), " cannot be at rest at sample ", first,
             ", after missing ones; expected estimated initial states or a warm-up");
      }
      if (end - first >= shortest) {
        ContinuousRun run{r,
                          first,
                          record.u.segment(first, end - first),
                          record.y.segment(first, end - first),
                          {},
                          periodic ? record.period : 0,
                          {},
                          {}};
        if (record.weights.size() > 0) run.weights = record.weights.segment(first, end - first);
        runs_.push_back(std::move(run));
      }
      first = end;
    }
  }
  if (runs_.empty()) {
    fail("continuous fit: expected a run of at least ", shortest, " output samples without a gap");
  }
  if (runs_.size() > kMostRuns) {
    fail("continuous fit: expected at most ", kMostRuns, " runs of samples, each with its own initial state, got ",
         runs_.size(), "; fill short gaps, or fit with refit(), which bridges them");
  }
  for (ContinuousRun& run : runs_) {
    run.held_u = held_signal(run.u, options_.input_hold, run.period);
    run.held_y = held_signal(run.y, options_.output_hold, run.period);
    if (options_.smoothed_regressand) {
      run.u = smoothed(run.u);
      run.y = smoothed(run.y);
    }
  }
}

bool ContinuousEquation::counts(const ContinuousRun& run, Index t) const {
  if (t < options_.warmup) return false;
  return !options_.smoothed_regressand || (t > 0 && t + 1 < run.y.size());
}

ContinuousEquation::Filter ContinuousEquation::filter_of(const VectorXd& d) const {
  const FilterBank bank = filter_bank(basis_);
  const Index n = order();
  const Eigen::RowVectorXd direct = numerator_map_.row(n);
  return {bank.a - bank.b * d.transpose(), bank.b, (numerator_map_.topRows(n) - d * direct).transpose(),
          direct.transpose()};
}

/// x_z last among the states of one system that u drives, x_u of the model and f of the model before it:
///   x_z' = A_d x_z + b z,   z = (b-part of theta) x_u + direct u + c f.
HeldStates ContinuousEquation::modelled_states(const Filter& filter, const Filter& model,
                                               const ContinuousUnknowns& theta, std::size_t run) const {
  const Index n = order();
  const Index free = initial_each_;
  const Index size = 2 * n + free;
  MatrixXd a = MatrixXd::Zero(size, size);
  VectorXd b = VectorXd::Zero(size);
  VectorXd start = VectorXd::Zero(size);
  a.topLeftCorner(n, n) = model.a;
  b.head(n) = model.b;
  a.bottomRightCorner(n, n) = filter.a;
  a.bottomLeftCorner(n, n) = filter.b * (model.outputs.transpose() * theta.b).transpose();
  b.tail(n) = filter.b * model.direct.dot(theta.b);
  if (free > 0) {
    a.block(n, n, n, n) = model.a;
    a.block(2 * n, n, n, n) = filter.b * theta.c[run].transpose();
    start.segment(n, n) = model.b;
  }
  HeldStates states(a, b, runs_[run].held_u, sample_time_s_, runs_[run].period);
  if (free > 0) states.start_at(start);
  return states;
}

QrTriangle ContinuousEquation::run_triangle(const Filter& filter, const ContinuousRun& run,
                                            HeldStates* modelled) const {
  const Index n = order();
  const Index m = numerators();
  const Index columns = initial_each_ + m + (modelled != nullptr ? 2 * n : n) + 1;
  HeldStates of_u(filter.a, filter.b, run.held_u, sample_time_s_, run.period);
  HeldStates of_y(filter.a, filter.b, run.held_y, sample_time_s_, run.period);
  const MatrixXd transition = matrix_exponential(filter.a * sample_time_s_);
  VectorXd impulse = filter.b;
  VectorXd next(n);
  QrTriangle triangle(columns);
  RowMajor tile(kTileRows, columns);
  Index filled = 0;
  const Index count = run.y.size();
  for (Index t = 0; t < count; ++t) {
    if (counts(run, t)) {
      auto row = tile.row(filled);
      if (initial_each_ > 0) row.head(n) = impulse.transpose();
      row.segment(initial_each_, m).transpose().noalias() = filter.outputs * of_u.state();
      row.segment(initial_each_, m) += run.u[t] * filter.direct.transpose();
      if (modelled != nullptr) row.segment(initial_each_ + m, n) = -modelled->state().tail(n).transpose();
      row.segment(columns - 1 - n, n) = -of_y.state().transpose();
      row[columns - 1] = run.y[t];
      if (run.weights.size() > 0) row *= run.weights[t];
      if (++filled == kTileRows) {
        triangle.add(tile.data(), filled, columns);
        filled = 0;
      }
    }
    if (t + 1 == count) break;
    of_u.step();
    of_y.step();
    if (modelled != nullptr) modelled->step();
    if (initial_each_ > 0) {
      next.noalias() = transition * impulse;
      impulse.swap(next);
    }
  }
  if (filled > 0) triangle.add(tile.data(), filled, columns);
  return triangle;
}

/// Rows of each run's triangle in the columns of all: its own initial state, then what runs share.
QrTriangle ContinuousEquation::joined(const std::vector<QrTriangle>& triangles) const {
  if (triangles.size() == 1) return triangles.front();
  const Index shared = triangles.front().columns() - initial_each_;
  QrTriangle all(initial_columns() + shared);
  for (Index r = 0; r < std::ssize(triangles); ++r) {
    const MatrixXd& part = triangles[static_cast<std::size_t>(r)].triangle();
    RowMajor rows = RowMajor::Zero(part.rows(), all.columns());
    rows.middleCols(r * initial_each_, initial_each_) = part.leftCols(initial_each_);
    rows.rightCols(shared) = part.rightCols(shared);
    all.add(rows.data(), rows.rows(), rows.cols());
  }
  return all;
}

QrTriangle ContinuousEquation::regression(const VectorXd& d) const {
  const Filter filter = filter_of(d);
  std::vector<QrTriangle> triangles;
  for (const ContinuousRun& run : runs_) triangles.push_back(run_triangle(filter, run, nullptr));
  return joined(triangles);
}

QrTriangle ContinuousEquation::regression(const VectorXd& d, const ContinuousUnknowns& model) const {
  const Filter filter = filter_of(d);
  const Filter of_model = filter_of(model.a);
  std::vector<QrTriangle> triangles;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    HeldStates modelled = modelled_states(filter, of_model, model, r);
    triangles.push_back(run_triangle(filter, runs_[r], &modelled));
  }
  return joined(triangles);
}

ContinuousUnknowns ContinuousEquation::unknowns_of(const VectorXd& x, const VectorXd& d) const {
  ContinuousUnknowns theta{x.tail(order()) + d, x.segment(initial_columns(), numerators()), {}};
  for (std::size_t r = 0; initial_each_ > 0 && r < runs_.size(); ++r) {
    theta.c.emplace_back(x.segment(static_cast<Index>(r) * initial_each_, initial_each_));
  }
  return theta;
}

VectorXd ContinuousEquation::coordinates_of(const ContinuousUnknowns& theta, const VectorXd& d) const {
  VectorXd x(unknowns());
  for (std::size_t r = 0; r < theta.c.size(); ++r) {
    x.segment(static_cast<Index>(r) * initial_each_, initial_each_) = theta.c[r];
  }
  x.segment(initial_columns(), numerators()) = theta.b;
  x.tail(order()) = theta.a - d;
  return x;
}

}  // namespace blockid::detail
