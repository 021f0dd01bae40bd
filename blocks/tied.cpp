#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/detail/infinity.hpp>
#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/text.hpp>
#include <blockid/blocks/tied.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

using detail::kInfinity;
using detail::view;

template <class T>
std::vector<T> followed(const std::vector<Tie>& ties, std::span<const T> theta) {
  std::vector<T> inner;
  inner.reserve(ties.size());
  for (const Tie& tie : ties) inner.push_back(tie.scale * theta[static_cast<std::size_t>(tie.index)] + tie.offset);
  return inner;
}

/// For each index up to the largest, the first tie that has it.
std::vector<Index> first_followers(const std::vector<Tie>& ties) {
  Index count = 0;
  for (const Tie& tie : ties) count = std::max(count, tie.index + 1);
  if (count > std::ssize(ties)) fail("tied: ", ties.size(), " inner parameters cannot follow ", count, " numbers");
  std::vector<Index> first(static_cast<std::size_t>(count), -1);
  for (std::size_t k = ties.size(); k-- > 0;) first[static_cast<std::size_t>(ties[k].index)] = static_cast<Index>(k);
  const auto unused = std::find(first.begin(), first.end(), -1);
  if (unused != first.end()) fail("tied: no inner parameter follows number ", unused - first.begin());
  return first;
}

std::vector<Tie> checked(const AnyBlock& inner, std::vector<Tie> ties) {
  if (std::ssize(ties) != inner.parameter_count()) {
    fail("tied: expected one tie for each of the ", inner.parameter_count(), " inner parameters, got ", ties.size());
  }
  for (const Tie& tie : ties) {
    if (tie.index < 0) fail("tied: an index must be >= 0, got ", tie.index);
    if (!std::isfinite(tie.scale) || tie.scale == 0.0 || !std::isfinite(tie.offset)) {
      fail("tied: scales must be finite and not 0, offsets finite, got ", tie.scale, " and ", tie.offset);
    }
  }
  return ties;
}

}  // namespace

Tied::Tied(AnyBlock inner, std::vector<Tie> ties)
    : inner_(std::move(inner)), ties_(checked(inner_, std::move(ties))), first_(first_followers(ties_)) {}

Eigen::VectorXd Tied::inner_parameters(std::span<const double> theta) const {
  const std::vector<double> inner = followed(ties_, theta);
  return Eigen::Map<const Eigen::VectorXd>(inner.data(), std::ssize(inner));
}

Eigen::VectorXd Tied::from_inner(std::span<const double> inner_theta) const {
  Eigen::VectorXd theta(parameter_count());
  for (Index j = 0; j < parameter_count(); ++j) {
    const auto k = static_cast<std::size_t>(first_[static_cast<std::size_t>(j)]);
    theta[j] = (inner_theta[k] - ties_[k].offset) / ties_[k].scale;
  }
  return theta;
}

Arguments Tied::arguments() const {
  std::vector<double> index;
  std::vector<double> scale;
  std::vector<double> offset;
  for (const Tie& tie : ties_) {
    index.push_back(static_cast<double>(tie.index));
    scale.push_back(tie.scale);
    offset.push_back(tie.offset);
  }
  Arguments result = {{"", to_nested_text(inner_)}};
  if (!index.empty()) result.emplace_back("to", detail::list_text(index));
  if (std::ranges::any_of(scale, [](double s) { return s != 1.0; })) {
    result.emplace_back("scale", detail::list_text(scale));
  }
  if (std::ranges::any_of(offset, [](double c) { return c != 0.0; })) {
    result.emplace_back("offset", detail::list_text(offset));
  }
  return result;
}

std::vector<std::string> Tied::parameter_names() const {
  const std::vector<std::string> inner = inner_.parameter_names();
  std::vector<std::string> names;
  for (const Index k : first_) names.push_back(inner[static_cast<std::size_t>(k)]);
  return names;
}

Eigen::VectorXd Tied::initial_parameters() const { return from_inner(view(inner_.initial_parameters())); }

ParameterBounds Tied::bounds() const {
  const ParameterBounds inner = inner_.bounds();
  ParameterBounds result{Eigen::VectorXd::Constant(parameter_count(), -kInfinity),
                         Eigen::VectorXd::Constant(parameter_count(), kInfinity)};
  for (std::size_t k = 0; k < ties_.size(); ++k) {
    const auto [index, scale, offset] = ties_[k];
    double lower = (inner.lower[static_cast<Index>(k)] - offset) / scale;
    double upper = (inner.upper[static_cast<Index>(k)] - offset) / scale;
    if (scale < 0.0) std::swap(lower, upper);
    result.lower[index] = std::max(result.lower[index], lower);
    result.upper[index] = std::min(result.upper[index], upper);
  }
  return result;
}

void Tied::apply(std::span<const double> theta, std::span<double> x, std::span<const double> u,
                 std::span<double> y) const {
  inner_.apply(followed(ties_, theta), x, u, y);
}

void Tied::apply(std::span<const TileJet> theta, std::span<TileJet> x, std::span<const TileJet> u,
                 std::span<TileJet> y) const {
  inner_.apply(followed(ties_, theta), x, u, y);
}

Index Tied::inner_stride(Index upstream, OwnColumns own) const {
  return padded_columns(upstream + inner_.own_columns(own));
}

Index Tied::tangent_memory(Index upstream, OwnColumns own) const {
  return kMaxTileRows * inner_stride(upstream, own) + inner_.tangent_memory(upstream, own);
}

void Tied::push_forward(std::span<const double> theta, std::span<double> x, std::span<double> memory,
                        std::span<const double> u, std::span<double> y, const Tangents& tangents,
                        OwnColumns own) const {
  const Tangents wide{memory.data(), tangents.rows, inner_stride(tangents.upstream, own), tangents.upstream};
  for (Index t = 0; t < tangents.rows; ++t) std::copy_n(tangents.row(t), tangents.upstream, wide.row(t));
  inner_.push_forward(followed(ties_, theta), x, memory.subspan(static_cast<std::size_t>(kMaxTileRows * wide.stride)),
                      u, y, wide, own);
  const std::vector<Index> order = inner_.column_order(own);
  const Index inner_count = inner_.parameter_count();
  for (Index t = 0; t < tangents.rows; ++t) {
    std::copy_n(wide.row(t), tangents.upstream, tangents.row(t));
    double* row = tangents.own(t);
    std::fill_n(row, parameter_count(), 0.0);
    for (std::size_t c = 0; c < order.size(); ++c) {
      const double value = wide.own(t)[c];
      if (order[c] >= inner_count) {
        row[parameter_count() + order[c] - inner_count] = value;
      } else {
        const Tie& tie = ties_[static_cast<std::size_t>(order[c])];
        row[tie.index] += tie.scale * value;
      }
    }
  }
}

std::optional<std::complex<double>> Tied::frequency_response(std::span<const double> theta, double omega) const {
  return inner_.frequency_response(followed(ties_, theta), omega);
}

}  // namespace blockid
