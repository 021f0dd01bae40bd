#include <blockid/blocks/parallel.hpp>

#include <blockid/blocks/detail/children.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <array>

namespace blockid {

Parallel::Parallel(std::vector<LabelledBlock> branches) : blocks_(std::move(branches)) {
  detail::ChildOffsets offsets = detail::child_offsets(blocks_, "parallel");
  for (const LabelledBlock& branch : blocks_) {
    if (branch.block.latency() != latency()) {
      fail("parallel: all branches must have the same latency, got ", latency(), " and ", branch.block.latency(),
           " samples; oversample all branches alike, or the sum as a whole");
    }
  }
  parameter_count_ = offsets.parameters.back();
  state_count_ = offsets.states.back();
  parameter_offsets_ = std::move(offsets.parameters);
  state_offsets_ = std::move(offsets.states);
}

std::vector<std::string> Parallel::parameter_names() const { return detail::joined_parameter_names(blocks_); }
Eigen::VectorXd Parallel::initial_parameters() const { return detail::joined_initial_parameters(blocks_); }
ParameterBounds Parallel::bounds() const { return detail::joined_bounds(blocks_); }
std::vector<Index> Parallel::column_order(OwnColumns own) const { return detail::joined_column_order(blocks_, own); }

bool Parallel::is_linear() const {
  return std::all_of(blocks_.begin(), blocks_.end(), [](const LabelledBlock& b) { return b.block.is_linear(); });
}

bool Parallel::is_linear_in_parameters() const {
  return std::all_of(blocks_.begin(), blocks_.end(),
                     [](const LabelledBlock& b) { return b.block.is_linear_in_parameters(); });
}

template <class T>
static void apply_parallel(const Parallel& sum, std::span<const T> theta, std::span<T> x, std::span<const T> u,
                           std::span<T> y) {
  const std::vector<LabelledBlock>& blocks = sum.children();
  std::array<T, static_cast<std::size_t>(kMaxTileRows)> buffer;
  for (std::size_t start = 0; start < u.size(); start += buffer.size()) {
    const std::size_t rows = std::min(buffer.size(), u.size() - start);
    const std::span<T> target = y.subspan(start, rows);
    std::fill(target.begin(), target.end(), T(0.0));
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const AnyBlock& block = blocks[k].block;
      const Index branch = static_cast<Index>(k);
      const std::span<T> output = std::span<T>(buffer).first(rows);
      block.apply(detail::part(theta, sum.parameter_offset(branch), block.parameter_count()),
                  detail::part(x, sum.state_offset(branch), block.state_count()), u.subspan(start, rows), output);
      for (std::size_t t = 0; t < rows; ++t) target[t] += output[t];
    }
  }
}

void Parallel::apply(std::span<const double> theta, std::span<double> x, std::span<const double> u,
                     std::span<double> y) const {
  apply_parallel(*this, theta, x, u, y);
}

void Parallel::apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
                     std::span<TileJet> y) const {
  apply_parallel(*this, theta, x, u, y);
}

// Memory: the sum of the upstream columns, one scratch tile for the branch at work, then each branch's own memory.
Index Parallel::tangent_memory(Index upstream, OwnColumns own) const {
  Index branches = 0;
  Index widest = 0;
  for (const LabelledBlock& branch : blocks_) {
    branches += branch.block.tangent_memory(upstream, own);
    widest = std::max(widest, padded_columns(upstream + branch.block.own_columns(own)));
  }
  return kMaxTileRows * (padded_columns(upstream) + widest) + branches;
}

void Parallel::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                            std::span<const double> u, std::span<double> y, const Tangents& tangents,
                            OwnColumns own) const {
  const Index rows = tangents.rows;
  const Index upstream = tangents.upstream;
  const Index sum_stride = padded_columns(upstream);
  Index widest = 0;
  for (const LabelledBlock& branch : blocks_) {
    widest = std::max(widest, padded_columns(upstream + branch.block.own_columns(own)));
  }
  double* sum = memory.data();
  double* scratch = sum + kMaxTileRows * sum_stride;
  Index used = kMaxTileRows * (sum_stride + widest);
  std::fill(sum, sum + rows * sum_stride, 0.0);
  std::fill(y.begin(), y.end(), 0.0);
  std::array<double, static_cast<std::size_t>(kMaxTileRows)> buffer;
  Index own_before = 0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const AnyBlock& block = blocks_[k].block;
    const Index own_here = block.own_columns(own);
    const Tangents branch{scratch, rows, padded_columns(upstream + own_here), upstream};
    for (Index t = 0; t < rows; ++t) std::copy_n(tangents.row(t), upstream, branch.row(t));
    const Index needed = block.tangent_memory(upstream, own);
    const std::span<double> output = std::span<double>(buffer).first(u.size());
    block.push_forward(detail::part(theta, parameter_offsets_[k], block.parameter_count()),
                       detail::part(x, state_offsets_[k], block.state_count()), detail::part(memory, used, needed), u,
                       output, branch, own);
    used += needed;
    for (Index t = 0; t < rows; ++t) {
      y[static_cast<std::size_t>(t)] += output[static_cast<std::size_t>(t)];
      for (Index c = 0; c < upstream; ++c) sum[t * sum_stride + c] += branch.row(t)[c];
      std::copy_n(branch.own(t), own_here, tangents.own(t) + own_before);
    }
    own_before += own_here;
  }
  for (Index t = 0; t < rows; ++t) std::copy_n(sum + t * sum_stride, upstream, tangents.row(t));
}

std::optional<std::complex<double>> Parallel::frequency_response(std::span<const double> theta, double omega) const {
  std::complex<double> total = 0.0;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const AnyBlock& block = blocks_[k].block;
    const auto term =
        block.frequency_response(detail::part(theta, parameter_offsets_[k], block.parameter_count()), omega);
    if (!term) return std::nullopt;
    total += *term;
  }
  return total;
}

}  // namespace blockid
