#include <blockid/blocks/series.hpp>

#include <blockid/blocks/detail/children.hpp>

#include <algorithm>
#include <array>

namespace blockid {
namespace {

/// Runs `push(k, input, output)` through the row of blocks with two buffers that change places.
template <class T, class Push>
void through_row(std::size_t blocks, std::span<const T> u, std::span<T> y, Push&& push) {
  std::array<T, static_cast<std::size_t>(kMaxTileRows)> buffers[2];
  std::span<const T> input = u;
  for (std::size_t k = 0; k < blocks; ++k) {
    const std::span<T> output = k + 1 == blocks ? y : std::span<T>(buffers[k % 2]).first(u.size());
    push(k, input, output);
    input = output;
  }
}

}  // namespace

Series::Series(std::vector<LabelledBlock> blocks) : blocks_(std::move(blocks)) {
  detail::ChildOffsets offsets = detail::child_offsets(blocks_, "series");
  parameter_count_ = offsets.parameters.back();
  state_count_ = offsets.states.back();
  parameter_offsets_ = std::move(offsets.parameters);
  state_offsets_ = std::move(offsets.states);
}

std::vector<std::string> Series::parameter_names() const { return detail::joined_parameter_names(blocks_); }
Eigen::VectorXd Series::initial_parameters() const { return detail::joined_initial_parameters(blocks_); }
ParameterBounds Series::bounds() const { return detail::joined_bounds(blocks_); }
std::vector<Index> Series::column_order(OwnColumns own) const { return detail::joined_column_order(blocks_, own); }

bool Series::is_linear() const {
  return std::all_of(blocks_.begin(), blocks_.end(), [](const LabelledBlock& b) { return b.block.is_linear(); });
}

bool Series::is_linear_in_parameters() const {
  bool behind_free = false;
  for (const LabelledBlock& child : blocks_) {
    if (behind_free && (child.block.parameter_count() > 0 || !child.block.is_linear())) return false;
    if (child.block.parameter_count() > 0) {
      if (!child.block.is_linear_in_parameters()) return false;
      behind_free = true;
    }
  }
  return true;
}

Index Series::latency() const {
  Index total = 0;
  for (const LabelledBlock& child : blocks_) total += child.block.latency();
  return total;
}

template <class T>
static void apply_series(const Series& series, std::span<const T> theta, std::span<T> x, std::span<const T> u,
                         std::span<T> y) {
  const std::vector<LabelledBlock>& blocks = series.children();
  for (std::size_t start = 0; start < u.size(); start += static_cast<std::size_t>(kMaxTileRows)) {
    const std::size_t rows = std::min(static_cast<std::size_t>(kMaxTileRows), u.size() - start);
    through_row<T>(blocks.size(), u.subspan(start, rows), y.subspan(start, rows),
                   [&](std::size_t k, std::span<const T> input, std::span<T> output) {
                     const AnyBlock& block = blocks[k].block;
                     const Index child = static_cast<Index>(k);
                     block.apply(detail::part(theta, series.parameter_offset(child), block.parameter_count()),
                                 detail::part(x, series.state_offset(child), block.state_count()), input, output);
                   });
  }
}

void Series::apply(std::span<const double> theta, std::span<double> x, std::span<const double> u,
                   std::span<double> y) const {
  apply_series(*this, theta, x, u, y);
}

void Series::apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
                   std::span<TileJet> y) const {
  apply_series(*this, theta, x, u, y);
}

Index Series::tangent_memory(Index upstream, OwnColumns own) const {
  Index total = 0;
  for (const LabelledBlock& child : blocks_) {
    total += child.block.tangent_memory(upstream, own);
    upstream += child.block.own_columns(own);
  }
  return total;
}

template <class Push>
void Series::push_children(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                           std::span<const double> u, std::span<double> y, const Tangents& tangents, OwnColumns own,
                           Push&& push) const {
  Tangents child = tangents;
  Index used = 0;
  through_row<double>(blocks_.size(), u, y,
                      [&](std::size_t k, std::span<const double> input, std::span<double> output) {
                        const AnyBlock& block = blocks_[k].block;
                        const Index needed = block.tangent_memory(child.upstream, own);
                        push(k, detail::part(theta, parameter_offsets_[k], block.parameter_count()),
                             detail::part(x, state_offsets_[k], block.state_count()),
                             detail::part(memory, used, needed), input, output, child);
                        used += needed;
                        child.upstream += block.own_columns(own);
                      });
}

void Series::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                          std::span<const double> u, std::span<double> y, const Tangents& tangents,
                          OwnColumns own) const {
  push_children(theta, x, memory, u, y, tangents, own,
                [&](std::size_t k, auto&&... arguments) { blocks_[k].block.push_forward(arguments..., own); });
}

bool Series::push_negated(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                          std::span<const double> u, std::span<double> y, const Tangents& tangents,
                          double* target) const {
  constexpr OwnColumns kOwn = OwnColumns::parameters;
  bool finite = true;
  push_children(theta, x, memory, u, y, tangents, kOwn, [&](std::size_t k, auto&&... arguments) {
    if (k + 1 < blocks_.size()) {
      blocks_[k].block.push_forward(arguments..., kOwn);
    } else {
      finite = blocks_[k].block.push_negated(arguments..., target);
    }
  });
  return finite;
}

std::optional<std::complex<double>> Series::frequency_response(std::span<const double> theta, double omega) const {
  std::complex<double> product = 1.0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const AnyBlock& block = blocks_[k].block;
    const auto factor =
        block.frequency_response(detail::part(theta, parameter_offsets_[k], block.parameter_count()), omega);
    if (!factor) return std::nullopt;
    product *= *factor;
  }
  return product;
}

}  // namespace blockid
