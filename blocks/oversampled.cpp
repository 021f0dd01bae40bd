#include <blockid/blocks/oversampled.hpp>

#include <blockid/blocks/detail/children.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <numbers>

namespace blockid {
namespace {

/// Rows at the higher rate that stay close to the processor with their tangents.
constexpr Index kFineRows = 128;

/// x = the last x.size() of [x, u].
template <class T>
void advance_history(std::span<T> x, std::span<const T> u) {
  const std::size_t kept = x.size() - std::min(x.size(), u.size());
  std::copy(x.end() - static_cast<std::ptrdiff_t>(kept), x.end(), x.begin());
  std::copy(u.end() - static_cast<std::ptrdiff_t>(x.size() - kept), u.end(),
            x.begin() + static_cast<std::ptrdiff_t>(kept));
}

/// Moves the last `kept` of `all` numbers to the front.
template <class T>
void keep_last(T* numbers, Index all, Index kept) {
  std::copy(numbers + all - kept, numbers + all, numbers);
}

/// work(first, rows) over [0, total) in pieces.
template <class Work>
void in_chunks(Index total, Index chunk, Work&& work) {
  for (Index first = 0; first < total; first += chunk) work(first, std::min(chunk, total - first));
}

AnyBlock checked(AnyBlock inner, Index factor, Index half_length) {
  if (factor < 2 || factor > Oversampled::kMaxFactor) {
    fail("oversampled: factor must be in 2..", Oversampled::kMaxFactor, ", got ", factor);
  }
  if (half_length < 2 || half_length > Oversampled::kMaxHalfLength) {
    fail("oversampled: half_length must be in 2..", Oversampled::kMaxHalfLength, ", got ", half_length);
  }
  if (inner.latency() != 0) {
    fail("oversampled: expected an inner block without latency, got one of ", inner.latency(),
         " samples; oversampled blocks do not nest");
  }
  return inner;
}

}  // namespace

Oversampled::Oversampled(AnyBlock inner, Index factor, Index half_length)
    : inner_(checked(std::move(inner), factor, half_length)), resampler_(factor, half_length) {}

Arguments Oversampled::arguments() const {
  Arguments result = {{"", to_nested_text(inner_)}, {"factor", std::to_string(factor())}};
  if (half_length() != kDefaultHalfLength) result.emplace_back("half_length", std::to_string(half_length()));
  return result;
}

Index Oversampled::latency() const { return inner_.is_static() ? resampler_.past() : half_length() - 1; }

Index Oversampled::chunk_rows() const { return std::max<Index>(kFineRows / factor(), 4); }

template <class T>
void Oversampled::run(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
  using detail::part;
  const Index past = resampler_.past();
  const Index factor = resampler_.factor();
  const bool decimates = inner_.is_static();
  const std::span<T> history = part(x, 0, input_history());
  const std::span<T> inner_state = part(x, input_history(), inner_.state_count());
  // Inputs, and outputs of the inner block, each behind its past.
  std::vector<T> window(static_cast<std::size_t>(past + chunk_rows()));
  std::vector<T> fine(static_cast<std::size_t>(chunk_rows() * factor));
  std::vector<T> output(static_cast<std::size_t>((past + chunk_rows()) * factor));
  const auto advance = [&](std::span<const T> inputs) {
    const Index rows = static_cast<Index>(inputs.size());
    std::copy(inputs.begin(), inputs.end(), window.begin() + past);
    const std::span<T> v = part(std::span<T>(fine), 0, rows * factor);
    resampler_.up(std::span<const T>(window).first(static_cast<std::size_t>(past + rows)), v);
    inner_.apply(theta, inner_state, v, part(std::span<T>(output), past * factor, rows * factor));
    keep_last(window.data(), past + rows, past);
  };
  std::copy_n(history.begin(), past, window.begin());
  if (decimates) {
    in_chunks(past, chunk_rows(), [&](Index first, Index rows) {
      advance(part(std::span<const T>(history), past + first, rows));
      keep_last(output.data(), (past + rows) * factor, past * factor);
    });
  }
  in_chunks(static_cast<Index>(u.size()), chunk_rows(), [&](Index first, Index rows) {
    advance(part(u, first, rows));
    const std::span<T> target = part(y, first, rows);
    if (decimates) {
      resampler_.down(std::span<const T>(output).first(static_cast<std::size_t>((past + rows) * factor)), target);
      keep_last(output.data(), (past + rows) * factor, past * factor);
    } else {
      for (Index n = 0; n < rows; ++n) {
        target[static_cast<std::size_t>(n)] = output[static_cast<std::size_t>((past + n + 1) * factor - 1)];
      }
    }
  });
  advance_history(history, u);
}

void Oversampled::apply(std::span<const double> theta, std::span<double> x, std::span<const double> u,
                        std::span<double> y) const {
  run(theta, x, u, y);
}

void Oversampled::apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
                        std::span<TileJet> y) const {
  run(theta, x, u, y);
}

Eigen::VectorXd Oversampled::interpolated(std::span<const double> u) const {
  const Index past = resampler_.past();
  std::vector<double> window(static_cast<std::size_t>(past), 0.0);
  window.insert(window.end(), u.begin(), u.end());
  Eigen::VectorXd fine(static_cast<Index>(u.size()) * factor());
  resampler_.up(std::span<const double>(window), detail::view(fine));
  return fine;
}

std::vector<Index> Oversampled::column_order(OwnColumns own) const {
  std::vector<Index> order;
  const Index parameters = parameter_count();
  const Index history = own == OwnColumns::parameters_and_state ? input_history() : 0;
  for (Index j = 0; j < history; ++j) order.push_back(parameters + j);
  for (const Index column : inner_.column_order(own)) {
    order.push_back(column < parameters ? column : column + history);
  }
  return order;
}

/// The memory between tiles: whether it has begun, tangents of the inputs behind their past, values and tangents of the
/// inner block's outputs behind theirs, and the inner block's own memory. To the inner block the past inputs of the
/// state are upstream columns like any other.
struct Oversampled::TileMemory {
  Index upstream;
  Index columns;
  Index input_stride;
  Index output_stride;
  Index input_rows;
  Index output_rows;
  Index inner;

  TileMemory(const Oversampled& block, Index given, OwnColumns own) {
    const Index past = block.resampler_.past();
    const Index factor = block.factor();
    upstream = given + (own == OwnColumns::parameters_and_state ? block.input_history() : 0);
    columns = upstream + block.inner_.own_columns(own);
    input_stride = padded_columns(upstream);
    output_stride = padded_columns(columns);
    input_rows = past + block.chunk_rows();
    output_rows = (past + block.chunk_rows()) * factor;
    inner = block.inner_.tangent_memory(upstream, own);
  }

  Index size() const { return 1 + input_rows * input_stride + output_rows * (1 + output_stride) + inner; }
};

Index Oversampled::tangent_memory(Index upstream, OwnColumns own) const {
  return TileMemory(*this, upstream, own).size();
}

void Oversampled::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                               std::span<const double> u, std::span<double> y, const Tangents& tangents,
                               OwnColumns own) const {
  using detail::part;
  const TileMemory layout(*this, tangents.upstream, own);
  const Index past = resampler_.past();
  const Index factor = resampler_.factor();
  const bool decimates = inner_.is_static();
  double* const begun = memory.data();
  double* const inputs = begun + 1;
  double* const values = inputs + layout.input_rows * layout.input_stride;
  double* const outputs = values + layout.output_rows;
  const std::span<double> inner_memory = part(memory, layout.size() - layout.inner, layout.inner);
  const std::span<double> history = part(x, 0, input_history());
  const std::span<double> inner_state = part(x, input_history(), inner_.state_count());

  std::vector<double> window(static_cast<std::size_t>(past + chunk_rows()));
  std::vector<double> fine(static_cast<std::size_t>(chunk_rows() * factor));
  // The tangents of `samples` lie in `inputs` behind their past already.
  const auto advance = [&](std::span<const double> samples) {
    const Index rows = static_cast<Index>(samples.size());
    std::copy(samples.begin(), samples.end(), window.begin() + past);
    const std::span<double> v = part(std::span<double>(fine), 0, rows * factor);
    resampler_.up(std::span<const double>(window).first(static_cast<std::size_t>(past + rows)), v);
    const Tangents tile{outputs + past * factor * layout.output_stride, rows * factor, layout.output_stride,
                        layout.upstream};
    resampler_.up_rows(inputs, layout.input_stride, rows, tile.data, tile.stride, layout.upstream);
    inner_.push_forward(theta, inner_state, inner_memory, v, {values + past * factor, v.size()}, tile, own);
    keep_last(window.data(), past + rows, past);
    keep_last(inputs, (past + rows) * layout.input_stride, past * layout.input_stride);
  };
  const auto keep_outputs = [&](Index rows) {
    keep_last(values, (past + rows) * factor, past * factor);
    keep_last(outputs, (past + rows) * factor * layout.output_stride, past * factor * layout.output_stride);
  };
  const auto seeded = [&](Index row, Index place) {
    double* tangent = inputs + row * layout.input_stride;
    std::fill_n(tangent, layout.upstream, 0.0);
    if (own == OwnColumns::parameters_and_state) tangent[tangents.upstream + place] = 1.0;
  };

  if (*begun == 0.0) {
    *begun = 1.0;
    std::copy_n(history.begin(), past, window.begin());
    for (Index j = 0; j < past; ++j) seeded(j, j);
    in_chunks(decimates ? past : 0, chunk_rows(), [&](Index first, Index rows) {
      for (Index j = 0; j < rows; ++j) seeded(past + j, past + first + j);
      advance(part(std::span<const double>(history), past + first, rows));
      keep_outputs(rows);
    });
  } else {
    std::copy_n(history.end() - past, past, window.begin());
  }
  in_chunks(tangents.rows, chunk_rows(), [&](Index first, Index rows) {
    for (Index n = 0; n < rows; ++n) {
      double* tangent = inputs + (past + n) * layout.input_stride;
      std::copy_n(tangents.row(first + n), tangents.upstream, tangent);
      std::fill_n(tangent + tangents.upstream, layout.upstream - tangents.upstream, 0.0);
    }
    advance(part(u, first, rows));
    double* const target = tangents.row(first);
    if (decimates) {
      resampler_.down(std::span<const double>(values, static_cast<std::size_t>((past + rows) * factor)),
                      part(y, first, rows));
      resampler_.down_rows(outputs, layout.output_stride, rows, target, tangents.stride, layout.columns);
      keep_outputs(rows);
      return;
    }
    for (Index n = 0; n < rows; ++n) {
      const Index last = (past + n + 1) * factor - 1;
      y[static_cast<std::size_t>(first + n)] = values[last];
      std::copy_n(outputs + last * layout.output_stride, layout.columns, target + n * tangents.stride);
    }
  });
  advance_history(history, u);
}

std::optional<std::complex<double>> Oversampled::frequency_response(std::span<const double> theta, double omega) const {
  // What lies at the M frequencies that every M-th sample cannot tell apart adds up.
  const double factor_of_rate = static_cast<double>(factor());
  std::complex<double> sum = 0.0;
  for (Index k = 0; k < factor(); ++k) {
    const double fine = (omega + 2.0 * std::numbers::pi * static_cast<double>(k)) / factor_of_rate;
    const std::optional<std::complex<double>> inner = inner_.frequency_response(theta, fine);
    if (!inner) return std::nullopt;
    const double filter = resampler_.response(fine) / factor_of_rate;
    sum += *inner * filter * (inner_.is_static() ? filter : 1.0);
  }
  return sum * std::polar(1.0, -omega * static_cast<double>(latency()));
}

Oversampled Oversampled::adapted_to(std::span<const double> v) const {
  if (!inner_.is_static()) return *this;
  const Eigen::VectorXd fine = interpolated(v);
  return around(inner_.adapted_to(detail::view(fine)));
}

std::optional<Rescaled> Oversampled::with_scaled_input(std::span<const double> theta, double k) const {
  const std::optional<Rescaled> scaled =
      inner_.is_static() ? inner_.with_scaled_input(theta, k) : std::optional<Rescaled>();
  if (!scaled) return std::nullopt;
  return Rescaled{around(scaled->block), scaled->parameters};
}

std::optional<Rescaled> Oversampled::with_scaled_output(std::span<const double> theta, double k) const {
  const std::optional<Rescaled> scaled =
      inner_.is_static() ? inner_.with_scaled_output(theta, k) : std::optional<Rescaled>();
  if (!scaled) return std::nullopt;
  return Rescaled{around(scaled->block), scaled->parameters};
}

std::optional<Rescaled> Oversampled::with_scaled_signals(std::span<const double> theta, double k) const {
  const std::optional<Rescaled> scaled =
      inner_.is_static() ? inner_.with_scaled_signals(theta, k) : std::optional<Rescaled>();
  if (!scaled) return std::nullopt;
  return Rescaled{around(scaled->block), scaled->parameters};
}

std::optional<Index> Oversampled::gain_parameter(std::span<const double> theta) const {
  return inner_.is_static() ? inner_.gain_parameter(theta) : std::optional<Index>();
}

std::optional<AnyBlock> static_block_of(const AnyBlock& block) {
  if (block.is_static()) return block;
  const auto* oversampled = block.target<Oversampled>();
  if (oversampled != nullptr && oversampled->inner().is_static()) return oversampled->inner();
  return std::nullopt;
}

AnyBlock without_oversampling(const AnyBlock& chain) {
  const bool is_row = chain.target<Series>() != nullptr;
  if (!is_row && chain.target<Parallel>() == nullptr) return static_block_of(chain).value_or(chain);
  std::vector<LabelledBlock> children = chain.children();
  for (LabelledBlock& child : children) child.block = without_oversampling(child.block);
  return is_row ? AnyBlock(Series(std::move(children))) : AnyBlock(Parallel(std::move(children)));
}

AnyBlock with_oversampling_of(const AnyBlock& pattern, const AnyBlock& plain) {
  const std::vector<LabelledBlock> wanted = pattern.children();
  std::vector<LabelledBlock> children = plain.children();
  if (wanted.size() != children.size()) {
    fail("with_oversampling_of: expected ", wanted.size(), " blocks in a row or sum, got ", children.size());
  }
  if (children.empty()) {
    const auto* oversampled = pattern.target<Oversampled>();
    const bool wraps = oversampled != nullptr && oversampled->inner().is_static() && plain.is_static();
    return wraps ? AnyBlock(oversampled->around(plain)) : plain;
  }
  for (std::size_t k = 0; k < children.size(); ++k) {
    children[k].block = with_oversampling_of(wanted[k].block, children[k].block);
  }
  return plain.target<Series>() != nullptr ? AnyBlock(Series(std::move(children)))
                                           : AnyBlock(Parallel(std::move(children)));
}

}  // namespace blockid
