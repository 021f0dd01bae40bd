#include <blockid/blocks/detail/held_filter.hpp>

#include <Eigen/LU>
#include <cstddef>

namespace blockid::detail {
namespace {

/// Outputs that mix_rows computes at once.
constexpr Index kMixed = 8;

}  // namespace

/// What lies in the memory between tiles.
struct HeldTangents::Parts {
  double* seen;
  /// Numbers of this theta.
  Eigen::Map<Eigen::MatrixXd> transition;
  Eigen::Map<Eigen::MatrixXd> heads;
  Eigen::Map<Eigen::VectorXd> entry;
  Eigen::Map<Eigen::MatrixXd> own;
  Eigen::Map<Eigen::VectorXd> direct;
  Eigen::Map<Eigen::MatrixXd> free_transition;
  Eigen::Map<Eigen::MatrixXd> free_own;
  Eigen::Map<Eigen::VectorXd> output;
  /// (taps,) with kConvolutionGuard zeros on both sides.
  double* response;
  /// (order + 1, order + 1) in groups of kMixed outputs, as mix_rows reads it: [xi; u] -> [next xi; output' xi].
  double* mixing;
  /// Numbers that move on.
  Eigen::Map<Eigen::VectorXd> state;
  Eigen::Map<Eigen::VectorXd> free_state;
  /// (transition')^t output
  Eigen::Map<Eigen::VectorXd> adjoint;
  /// (taps - 1,) impulse response g_{t+1}, g_{t+2}, ...
  Eigen::Map<Eigen::VectorXd> window;
  /// (order + 1, stride) twice: states of the upstream columns, then their input that enters next.
  double* columns;
  double* columns_next;
  /// Rows 1 - taps .. kMaxTileRows - 1 of the upstream columns before the filter; points at row 0.
  double* rows;
};

HeldTangents::HeldTangents(const Shape& shape, Index upstream)
    : shape_(shape), upstream_(upstream), stride_(padded_columns(upstream)) {
  const auto [n, taps, lag, parameters, signals, free] = shape;
  size_ = 1 + signals * (signals + taps + 1) + parameters * (signals + 1) + free * (free + parameters) + n + taps +
          2 * kConvolutionGuard + (n + 1) * (n + 1) + signals + free + n + taps - 1 +
          stride_ * (2 * (n + 1) + taps - 1 + kMaxTileRows);
}

HeldTangents::Parts HeldTangents::parts(std::span<double> memory) const {
  const auto [n, taps, lag, parameters, signals, free] = shape_;
  double* next = memory.data();
  const auto take = [&next](Index count) {
    double* place = next;
    next += count;
    return place;
  };
  const auto matrix = [&take](Index rows, Index cols) {
    return Eigen::Map<Eigen::MatrixXd>(take(rows * cols), rows, cols);
  };
  const auto vector = [&take](Index rows) { return Eigen::Map<Eigen::VectorXd>(take(rows), rows); };
  return {.seen = take(1),
          .transition = matrix(signals, signals),
          .heads = matrix(signals, taps),
          .entry = vector(signals),
          .own = matrix(parameters, signals),
          .direct = vector(parameters),
          .free_transition = matrix(free, free),
          .free_own = matrix(parameters, free),
          .output = vector(n),
          .response = take(taps + 2 * kConvolutionGuard) + kConvolutionGuard,
          .mixing = take((n + 1) * (n + 1)),
          .state = vector(signals),
          .free_state = vector(free),
          .adjoint = vector(n),
          .window = vector(taps - 1),
          .columns = take((n + 1) * stride_),
          .columns_next = take((n + 1) * stride_),
          .rows = take((taps - 1 + kMaxTileRows) * stride_) + (taps - 1) * stride_};
}

void HeldTangents::start(std::span<double> memory, const HeldFilter<double>& filter,
                         const HeldTangentSources& sources) const {
  Parts p = parts(memory);
  p.transition = sources.signals.transition;
  p.heads = sources.signals.heads;
  p.entry = sources.signals.entry;
  p.own = sources.own;
  p.direct = sources.direct;
  p.free_transition = sources.free_transition;
  p.free_own = sources.free_own;
  p.free_state = sources.free_start;
  p.output = filter.output();
  p.adjoint = filter.output();
  std::copy(filter.response().begin(), filter.response().end(), p.response);
  std::copy(filter.response().begin() + 1, filter.response().end(), p.window.data());
  const Index n = shape_.order;
  double* group = p.mixing;
  for (Index first = 0; first <= n; first += kMixed) {
    const Index outputs = std::min(kMixed, n + 1 - first);
    for (Index k = 0; k <= n; ++k) {
      for (Index r = 0; r < outputs; ++r) {
        const Index row = first + r;
        const double of_state =
            row < n ? filter.system().transition(row, std::min(k, n - 1)) : p.output[std::min(k, n - 1)];
        const double of_input = row < n ? filter.system().entry[row] : 0.0;
        group[k * outputs + r] = k < n ? of_state : of_input;
      }
    }
    group += (n + 1) * outputs;
  }
}

void HeldTangents::push(std::span<double> x, std::span<double> memory, std::span<const double> u, std::span<double> y,
                        const Tangents& tangents, OwnColumns own) const {
  Parts p = parts(memory);
  if (tangents.rows == 0) return;
  push_upstream(p, tangents);
  const auto n = static_cast<std::size_t>(shape_.order);
  const std::span<double> past = x.subspan(n);
  std::vector<double> all(past.rbegin(), past.rend());
  all.insert(all.end(), u.begin(), u.end());
  push_own(p, all, x, y, tangents);
  std::copy_n(all.rbegin(), past.size(), past.begin());
  if (own == OwnColumns::parameters_and_state) push_states(p, tangents);
  *p.seen += static_cast<double>(tangents.rows);
}

void HeldTangents::push_upstream(Parts& p, const Tangents& tangents) const {
  if (upstream_ == 0) return;
  const Index n = shape_.order;
  const Index taps = shape_.taps;
  for (Index t = 0; t < tangents.rows; ++t) {
    double* row = p.rows + t * stride_;
    std::copy_n(tangents.row(t), upstream_, row);
    std::fill(row + upstream_, row + stride_, 0.0);
  }
  const Kernels& kernel = kernels();
  kernel.convolve_columns(p.response, taps - 1, p.rows, stride_, tangents.data, tangents.stride, tangents.rows,
                          stride_);
  double* state = p.columns;
  double* next = p.columns_next;
  for (Index t = 0; t < tangents.rows; ++t) {
    std::copy_n(p.rows + (t + 1 - taps) * stride_, stride_, state + n * stride_);
    const double* group = p.mixing;
    for (Index first = 0; first <= n; first += kMixed) {
      const Index outputs = std::min(kMixed, n + 1 - first);
      kernel.mix_rows(group, n + 1, outputs, state, stride_, next + first * stride_, stride_, stride_);
      group += (n + 1) * outputs;
    }
    double* out = tangents.row(t);
    const double* added = next + n * stride_;
    for (Index c = 0; c < upstream_; ++c) out[c] += added[c];
    std::swap(state, next);
  }
  if (state != p.columns) std::copy_n(state, n * stride_, p.columns);
  std::copy(p.rows + (tangents.rows + 1 - taps) * stride_, p.rows + tangents.rows * stride_,
            p.rows + (1 - taps) * stride_);
}

void HeldTangents::push_own(Parts& p, std::span<const double> all, std::span<double> x, std::span<double> y,
                            const Tangents& tangents) const {
  const Index n = shape_.order;
  const Index taps = shape_.taps;
  const Index rows = tangents.rows;
  const Eigen::Map<const Eigen::VectorXd> input(all.data(), std::ssize(all));
  Eigen::Map<Eigen::VectorXd> filter_state(x.data(), n);
  Eigen::VectorXd next_filter_state(n);
  Eigen::VectorXd state = p.state;
  Eigen::VectorXd free = p.free_state;
  Eigen::VectorXd next(state.size());
  Eigen::VectorXd next_free(free.size());
  Eigen::VectorXd signal(state.size());
  Eigen::VectorXd column(shape_.parameters);
  kernels().convolve_signal(p.response, taps - 1, all.data() + taps - 1, y.data(), rows);
  for (Index t = 0; t < rows; ++t) {
    y[static_cast<std::size_t>(t)] += p.output.dot(filter_state);
    next_filter_state.noalias() = p.transition.topLeftCorner(n, n) * filter_state;
    filter_state = next_filter_state + p.entry.head(n) * input[t];
    signal = state;
    for (Index j = 0; j < taps; ++j) signal += p.heads.col(j) * input[t + taps - 1 - j];
    const double direct_input = input[t + taps - 1 - shape_.lag];
    column.noalias() = p.own * signal;
    column.noalias() += p.free_own * free;
    column += p.direct * direct_input;
    std::copy(column.begin(), column.end(), tangents.own(t));
    next.noalias() = p.transition * state;
    next += p.entry * input[t];
    state.swap(next);
    next_free.noalias() = p.free_transition * free;
    free.swap(next_free);
  }
  p.state = state;
  p.free_state = free;
}

void HeldTangents::push_states(Parts& p, const Tangents& tangents) const {
  const Index n = shape_.order;
  const Index past = shape_.taps - 1;
  Eigen::VectorXd adjoint = p.adjoint;
  std::vector<double> window(p.window.begin(), p.window.end());
  window.reserve(window.size() + static_cast<std::size_t>(tangents.rows));
  for (Index t = 0; t < tangents.rows; ++t) {
    double* row = tangents.own(t) + shape_.parameters;
    std::copy(adjoint.begin(), adjoint.end(), row);
    std::copy_n(window.begin() + t, past, row + n);
    window.push_back(adjoint.dot(p.entry.head(n)));
    adjoint = (p.transition.topLeftCorner(n, n).transpose() * adjoint).eval();
  }
  p.adjoint = adjoint;
  std::copy(window.end() - past, window.end(), p.window.data());
}

std::complex<double> frequency_response(const HeldFilter<double>& filter, double omega) {
  const std::complex<double> shift = std::polar(1.0, -omega);
  std::complex<double> sum = 0.0;
  for (Index j = filter.taps(); j-- > 0;) sum = sum * shift + filter.response()[static_cast<std::size_t>(j)];
  const Index n = filter.order();
  const Eigen::MatrixXcd resolvent =
      Eigen::MatrixXcd::Identity(n, n) - shift * filter.system().transition.cast<std::complex<double>>();
  const Eigen::VectorXcd entry = filter.system().entry.cast<std::complex<double>>();
  const Eigen::VectorXcd tail = resolvent.partialPivLu().solve(entry);
  const Eigen::VectorXcd output = filter.output().cast<std::complex<double>>();
  return sum + std::polar(1.0, -omega * static_cast<double>(filter.taps())) * (output.transpose() * tail).value();
}

}  // namespace blockid::detail
