#include <blockid/estimators/predictor.hpp>

#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/flush_denormals.hpp>
#include <blockid/estimators/detail/line_aligned_array.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace blockid {
namespace {

using detail::view;

/// Bytes of a tangent tile that stay close to the processor; measured by bench/derivatives_bench.
constexpr Index kTileBytes = 48 * 1024;

Index tile_rows(Index stride) {
  const Index rows = kTileBytes / static_cast<Index>(sizeof(double)) / stride / 8 * 8;
  return std::clamp<Index>(rows, 32, kMaxTileRows);
}

bool all_finite(std::span<const double> values) {
  return detail::kernels().all_finite(values.data(), std::ssize(values));
}

}  // namespace

/// The samples that pass through the chain for one record: run-in periods, the record, and what flushes the latency.
struct Predictor::Timeline {
  const Record& record;
  Index run_in;
  Index latency;
  Index length;

  Timeline(const Record& r, const PredictionOptions& options, Index chain_latency)
      : record(r),
        run_in(options.initial_state == InitialState::periodic ? options.run_in_periods * r.period : 0),
        latency(chain_latency),
        length(run_in + r.u.size() + chain_latency) {}

  double input(Index time) const {
    const Index t = time - run_in;
    if (t < 0) return record.u[(t % record.period + record.period) % record.period];
    if (t < record.u.size()) return record.u[t];
    return run_in > 0 ? record.u[t % record.period] : 0.0;
  }

  /// The inputs of a tile: the record's own memory where it lies within, else a copy in `buffer`.
  std::span<const double> inputs(Index first, Index rows, std::span<double> buffer) const {
    const Index t = first - run_in;
    if (t >= 0 && t + rows <= record.u.size()) return {record.u.data() + t, static_cast<std::size_t>(rows)};
    for (Index k = 0; k < rows; ++k) buffer[static_cast<std::size_t>(k)] = input(first + k);
    return buffer.first(static_cast<std::size_t>(rows));
  }

  /// The sample of the record that the chain's output at `time` predicts; outside [0, N) it predicts none.
  Index predicted(Index time) const { return time - run_in - latency; }
};

Predictor::Predictor(AnyBlock chain, const DataSet& data, PredictionOptions options)
    : chain_(std::move(chain)), data_(&data), options_(options) {
  check(data);
  if (options.warmup < 0) fail("predictor: the warm-up must be >= 0 samples, got ", options.warmup);
  for (const Record& record : data.records) {
    const Index length = record.u.size();
    if (length <= options.warmup) {
      fail(describe(record), ": has ", length, " samples, no more than the warm-up of ", options.warmup);
    }
    if (options.initial_state == InitialState::periodic && record.period <= 0) {
      fail(describe(record), ": a periodic initial state needs the record's period, got ", record.period);
    }
    samples_ += length;
    for (Index t = options.warmup; t < length; ++t) {
      if (!is_missing(record, t)) ++counted_;
    }
  }
  if (options.initial_state == InitialState::periodic && options.run_in_periods < 1) {
    fail("predictor: a periodic initial state needs at least one run-in period, got ", options.run_in_periods);
  }
}

OwnColumns Predictor::own() const {
  return options_.initial_state == InitialState::estimated ? OwnColumns::parameters_and_state : OwnColumns::parameters;
}

Index Predictor::unknown_count() const {
  const Index states = options_.initial_state == InitialState::estimated ? chain_.state_count() : 0;
  return chain_.parameter_count() + states * static_cast<Index>(data_->records.size());
}

void Predictor::check_unknowns(const Eigen::VectorXd& p) const {
  if (p.size() != unknown_count()) {
    fail("predictor: expected ", unknown_count(), " unknowns (", chain_.parameter_count(),
         " parameters and the estimated initial states), got ", p.size());
  }
}

Eigen::VectorXd Predictor::start_state(const Eigen::VectorXd& p, Index record) const {
  const Index states = chain_.state_count();
  if (options_.initial_state != InitialState::estimated) return Eigen::VectorXd::Zero(states);
  return p.segment(chain_.parameter_count() + record * states, states);
}

std::vector<Index> Predictor::unknown_of_column(Index record) const {
  std::vector<Index> order = chain_.column_order(own());
  const Index parameters = chain_.parameter_count();
  for (Index& column : order) {
    if (column >= parameters) column += record * chain_.state_count();
  }
  return order;
}

/// sink(first, y): outputs of the chain from time `first` on.
template <class Sink>
bool Predictor::run_values(const Eigen::VectorXd& p, Index record, Sink&& sink) const {
  const detail::FlushDenormals no_subnormals;
  const Timeline timeline(data_->records[static_cast<std::size_t>(record)], options_, chain_.latency());
  const std::span<const double> theta = view(p).first(static_cast<std::size_t>(chain_.parameter_count()));
  Eigen::VectorXd x = start_state(p, record);
  std::array<double, static_cast<std::size_t>(kMaxTileRows)> input_buffer;
  std::array<double, static_cast<std::size_t>(kMaxTileRows)> output_buffer;
  for (Index first = 0; first < timeline.length; first += kMaxTileRows) {
    const Index rows = std::min(kMaxTileRows, timeline.length - first);
    const std::span<double> y = std::span<double>(output_buffer).first(static_cast<std::size_t>(rows));
    chain_.apply(theta, view(x), timeline.inputs(first, rows, input_buffer), y);
    if (!all_finite(y)) return false;
    sink(timeline, first, std::span<const double>(y));
  }
  return true;
}

/// sink(timeline, first, y, tangents): a tile of outputs from time `first` on with their derivatives.
template <class Sink>
bool Predictor::run_tangents(const Eigen::VectorXd& p, Index record, Sink&& sink) const {
  const auto tile = [](const Timeline&, Index) -> double* { return nullptr; };
  return run_tangents(p, record, tile, sink);
}

/// The same, but target(timeline, first) says where rows -dyhat/dp go at once, packed; the tile that the sink sees then
/// has no data. Null: they stay in the tile.
template <class Target, class Sink>
bool Predictor::run_tangents(const Eigen::VectorXd& p, Index record, Target&& target, Sink&& sink) const {
  const detail::FlushDenormals no_subnormals;
  const Timeline timeline(data_->records[static_cast<std::size_t>(record)], options_, chain_.latency());
  const std::span<const double> theta = view(p).first(static_cast<std::size_t>(chain_.parameter_count()));
  const Index columns = chain_.own_columns(own());
  // One column more than the tangents: the residual stands beside them.
  const Index stride = padded_columns(columns + 1);
  const Index tile = tile_rows(stride);
  Eigen::VectorXd x = start_state(p, record);
  std::vector<double> memory(static_cast<std::size_t>(chain_.tangent_memory(0, own())), 0.0);
  const detail::LineAlignedArray data(tile * stride);
  std::array<double, static_cast<std::size_t>(kMaxTileRows)> input_buffer;
  std::array<double, static_cast<std::size_t>(kMaxTileRows)> output_buffer;
  for (Index first = 0; first < timeline.length; first += tile) {
    const Index rows = std::min(tile, timeline.length - first);
    const std::span<double> y = std::span<double>(output_buffer).first(static_cast<std::size_t>(rows));
    const std::span<const double> u = timeline.inputs(first, rows, input_buffer);
    Tangents tangents{data.data(), rows, stride, 0};
    if (double* packed = target(timeline, first)) {
      if (!chain_.push_negated(theta, view(x), memory, u, y, tangents, packed)) return false;
      tangents.data = nullptr;
    } else {
      chain_.push_forward(theta, view(x), memory, u, y, tangents, own());
    }
    if (!all_finite(y)) return false;
    sink(timeline, first, std::span<const double>(y), tangents);
  }
  return true;
}

namespace {

/// w_t, zero in the warm-up, for missing samples and outside the record.
double counted_weight(const Record& record, Index t, Index warmup) {
  if (t < warmup || t >= record.u.size()) return 0.0;
  return weight(record, t);
}

/// Whether every sample from `first` on has weight one.
bool counts_fully(const Record& record, Index first, Index warmup) {
  return record.weights.size() == 0 && first >= warmup;
}

double weighted_residual(const Record& record, Index t, double w, double yhat) {
  return w == 0.0 ? 0.0 : w * (record.y[t] - yhat);
}

}  // namespace

namespace {

/// Rows -w dyhat/dp of a tile into the columns of their unknowns, weights null for ones; false when one is not finite.
bool write_rows(const Tangents& tangents, const double* weights, const std::vector<Index>& order, bool in_order,
                Index unknowns, double* target) {
  if (in_order) {
    return detail::kernels().negated_rows(tangents.data, tangents.rows, tangents.stride, unknowns, weights, target);
  }
  double check = 0.0;
  for (Index k = 0; k < tangents.rows; ++k) {
    for (std::size_t c = 0; c < order.size(); ++c) {
      const double value = (weights == nullptr ? -1.0 : -weights[k]) * tangents.row(k)[c];
      check += 0.0 * value;
      target[k * unknowns + order[c]] = value;
    }
  }
  return check == 0.0;
}

}  // namespace

bool Predictor::residuals(const Eigen::VectorXd& p, double* r) const {
  check_unknowns(p);
  for (std::size_t i = 0; i < data_->records.size(); ++i) {
    const bool finite =
        run_values(p, static_cast<Index>(i), [&](const Timeline& timeline, Index first, std::span<const double> y) {
          for (std::size_t k = 0; k < y.size(); ++k) {
            const Index t = timeline.predicted(first + static_cast<Index>(k));
            if (t < 0) continue;
            r[t] = weighted_residual(timeline.record, t, counted_weight(timeline.record, t, options_.warmup), y[k]);
          }
        });
    if (!finite) return false;
    r += data_->records[i].u.size();
  }
  return true;
}

double Predictor::sum_of_squares(const Eigen::VectorXd& p) const {
  check_unknowns(p);
  double total = 0.0;
  for (std::size_t i = 0; i < data_->records.size(); ++i) {
    const bool unit_weights = data_->records[i].weights.size() == 0;
    const bool finite =
        run_values(p, static_cast<Index>(i), [&](const Timeline& timeline, Index first, std::span<const double> y) {
          const Index t0 = timeline.predicted(first);
          double sum = 0.0;
          for (Index k = std::max<Index>(0, options_.warmup - t0); k < std::ssize(y); ++k) {
            const Index t = t0 + k;
            const double w = unit_weights ? 1.0 : counted_weight(timeline.record, t, options_.warmup);
            const double residual = weighted_residual(timeline.record, t, w, y[static_cast<std::size_t>(k)]);
            sum += residual * residual;
          }
          total += sum;
        });
    if (!finite) return std::numeric_limits<double>::infinity();
  }
  return total;
}

bool Predictor::jacobian(const Eigen::VectorXd& p, double* r, double* jacobian) const {
  check_unknowns(p);
  const Index unknowns = unknown_count();
  for (std::size_t i = 0; i < data_->records.size(); ++i) {
    const Record& record = data_->records[i];
    const std::vector<Index> order = unknown_of_column(static_cast<Index>(i));
    const bool in_order = std::is_sorted(order.begin(), order.end()) && std::ssize(order) == unknowns;
    if (!in_order) std::fill(jacobian, jacobian + record.u.size() * unknowns, 0.0);
    std::array<double, static_cast<std::size_t>(kMaxTileRows)> weights;
    // Rows that all count and whose columns stand in the order of the unknowns need no stop in the tile.
    const bool direct = in_order && own() == OwnColumns::parameters;
    const auto target = [&](const Timeline& timeline, Index first) -> double* {
      const Index t = timeline.predicted(first);
      return direct && t >= 0 && counts_fully(record, t, options_.warmup) ? jacobian + t * unknowns : nullptr;
    };
    bool finite = true;
    const bool completed = run_tangents(
        p, static_cast<Index>(i), target,
        [&](const Timeline& timeline, Index first, std::span<const double> y, const Tangents& tangents) {
          if (tangents.data == nullptr) {
            const Index t = timeline.predicted(first);
            return detail::kernels().residual(record.y.data() + t, y.data(), r + t, std::ssize(y));
          }
          const Index skipped = std::clamp<Index>(-timeline.predicted(first), 0, tangents.rows);
          const Index t0 = timeline.predicted(first) + skipped;
          const Tangents counted{tangents.row(skipped), tangents.rows - skipped, tangents.stride, 0};
          const std::span<const double> predicted = y.subspan(static_cast<std::size_t>(skipped));
          const bool all_count = counts_fully(record, t0, options_.warmup);
          if (all_count) {
            for (std::size_t k = 0; k < predicted.size(); ++k) {
              r[t0 + static_cast<Index>(k)] = record.y[t0 + static_cast<Index>(k)] - predicted[k];
            }
          } else {
            for (std::size_t k = 0; k < predicted.size(); ++k) {
              const Index t = t0 + static_cast<Index>(k);
              weights[k] = counted_weight(record, t, options_.warmup);
              r[t] = weighted_residual(record, t, weights[k], predicted[k]);
            }
          }
          const double* weight_of_row = all_count ? nullptr : weights.data();
          finite = write_rows(counted, weight_of_row, order, in_order, unknowns, jacobian + t0 * unknowns) && finite;
        });
    if (!completed || !finite) return false;
    r += record.u.size();
    jacobian += record.u.size() * unknowns;
  }
  return true;
}

namespace {

/// Turns a tile of dyhat/dp into rows [-w dyhat/dp, w (y - yhat)], in place; rows that do not count become zero.
/// The sign of J is left as it is and that of r turned instead: J'J and J'r are those of [-w dyhat, r].
/// first_sample: sample of the record that row 0 predicts.
void finish_rows(const Record& record, Index first_sample, Index warmup, std::span<const double> y,
                 const Tangents& tangents, Index columns) {
  if (counts_fully(record, first_sample, warmup)) {
    const double* measured = record.y.data() + first_sample;
    double* row = tangents.data + columns;
    for (std::size_t k = 0; k < y.size(); ++k, row += tangents.stride) *row = y[k] - measured[k];
    return;
  }
  for (Index k = 0; k < tangents.rows; ++k) {
    const Index t = first_sample + k;
    double* row = tangents.row(k);
    const double w = counted_weight(record, t, warmup);
    if (w == 0.0) {
      std::fill(row, row + columns + 1, 0.0);
      continue;
    }
    for (Index c = 0; c < columns; ++c) row[c] *= w;
    row[columns] = w * (y[static_cast<std::size_t>(k)] - record.y[t]);
  }
}

/// Columns in the order of the unknowns, those of other records zero.
Eigen::MatrixXd in_order_of_unknowns(const Eigen::MatrixXd& gram, const std::vector<Index>& order, Index unknowns) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(unknowns + 1, unknowns + 1);
  const Index columns = static_cast<Index>(order.size());
  const auto place = [&](Index c) { return c < columns ? order[static_cast<std::size_t>(c)] : unknowns; };
  for (Index j = 0; j <= columns; ++j) {
    for (Index i = 0; i <= columns; ++i) result(place(i), place(j)) = gram(i, j);
  }
  return result;
}

}  // namespace

bool Predictor::accumulate(const Eigen::VectorXd& p, NormalEquations& sums) const {
  check_unknowns(p);
  const Index unknowns = unknown_count();
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(unknowns + 1, unknowns + 1);
  Index rows = 0;
  for (std::size_t i = 0; i < data_->records.size(); ++i) {
    const std::vector<Index> order = unknown_of_column(static_cast<Index>(i));
    const Index columns = static_cast<Index>(order.size());
    NormalEquations local(columns + 1);
    const bool finite =
        run_tangents(p, static_cast<Index>(i),
                     [&](const Timeline& timeline, Index first, std::span<const double> y, const Tangents& tangents) {
                       finish_rows(timeline.record, timeline.predicted(first), options_.warmup, y, tangents, columns);
                       local.add(tangents.data, tangents.rows, tangents.stride);
                     });
    const Eigen::MatrixXd gram = local.gram();
    if (!finite || !gram.allFinite()) return false;
    total += in_order_of_unknowns(gram, order, unknowns);
    rows += local.rows();
  }
  sums.add(total, rows);
  return true;
}

bool Predictor::accumulate(const Eigen::VectorXd& p, QrTriangle& sums) const {
  check_unknowns(p);
  const Index unknowns = unknown_count();
  QrTriangle total = sums;
  std::vector<double> ordered;
  for (std::size_t i = 0; i < data_->records.size(); ++i) {
    const std::vector<Index> order = unknown_of_column(static_cast<Index>(i));
    const Index columns = static_cast<Index>(order.size());
    const bool finite =
        run_tangents(p, static_cast<Index>(i),
                     [&](const Timeline& timeline, Index first, std::span<const double> y, const Tangents& tangents) {
                       finish_rows(timeline.record, timeline.predicted(first), options_.warmup, y, tangents, columns);
                       ordered.assign(static_cast<std::size_t>(tangents.rows * (unknowns + 1)), 0.0);
                       for (Index k = 0; k < tangents.rows; ++k) {
                         double* target = ordered.data() + k * (unknowns + 1);
                         for (std::size_t c = 0; c < order.size(); ++c) target[order[c]] = tangents.row(k)[c];
                         target[unknowns] = tangents.row(k)[columns];
                       }
                       total.add(ordered.data(), tangents.rows, unknowns + 1);
                     });
    if (!finite) return false;
  }
  if (!total.triangle().allFinite()) return false;
  sums = total;
  return true;
}

Eigen::MatrixXd Predictor::score_batches(const Eigen::VectorXd& p, Index batch) const {
  check_unknowns(p);
  const Index unknowns = unknown_count();
  Index batches = 0;
  for (const Record& record : data_->records) batches += (record.u.size() + batch - 1) / batch;
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(batches, unknowns);
  Index base = 0;
  for (std::size_t i = 0; i < data_->records.size(); ++i) {
    const std::vector<Index> order = unknown_of_column(static_cast<Index>(i));
    const Index columns = static_cast<Index>(order.size());
    run_tangents(p, static_cast<Index>(i),
                 [&](const Timeline& timeline, Index first, std::span<const double> y, const Tangents& tangents) {
                   finish_rows(timeline.record, timeline.predicted(first), options_.warmup, y, tangents, columns);
                   for (Index k = 0; k < tangents.rows; ++k) {
                     const Index t = timeline.predicted(first + k);
                     if (t < 0) continue;
                     const double* row = tangents.row(k);
                     for (Index c = 0; c < columns; ++c) {
                       scores(base + t / batch, order[static_cast<std::size_t>(c)]) += row[columns] * row[c];
                     }
                   }
                 });
    base += (data_->records[i].u.size() + batch - 1) / batch;
  }
  return scores;
}

Eigen::VectorXd Predictor::predict(const Eigen::VectorXd& p, Index record) const {
  check_unknowns(p);
  Eigen::VectorXd yhat = Eigen::VectorXd::Constant(data_->records[static_cast<std::size_t>(record)].u.size(),
                                                   std::numeric_limits<double>::quiet_NaN());
  run_values(p, record, [&](const Timeline& timeline, Index first, std::span<const double> y) {
    for (std::size_t k = 0; k < y.size(); ++k) {
      const Index t = timeline.predicted(first + static_cast<Index>(k));
      if (t >= 0) yhat[t] = y[k];
    }
  });
  return yhat;
}

}  // namespace blockid
