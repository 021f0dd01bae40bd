// Knots of the static blocks that are made of pieces: where they lie, and which piece an input falls in.
#pragma once

#include <blockid/blocks/arguments.hpp>
#include <blockid/blocks/block.hpp>
#include <blockid/blocks/signal_range.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace blockid {

/// How knots are placed for a signal v.
enum class KnotPlacement {
  mixed,     ///< half of them uniform over the range of v, half at quantiles of v
  uniform,   ///< equal distances over the range of v
  quantile,  ///< equal numbers of samples between them
};

/// "mixed", "uniform" or "quantile".
std::string_view name_of(KnotPlacement placement);

/// The placement of that name, or nothing.
std::optional<KnotPlacement> knot_placement(std::string_view name);

/// `count` strictly increasing knots for the signal v (N,); the first is the minimum of v and the last its maximum.
///
/// Neighbours are at least range / (100 (count - 1)) apart. Where quantiles fall closer together (values that repeat),
/// the knots saved halve the widest intervals.
/// Throws Error unless 2 <= count <= Knots::kMaxCount and v is finite, not constant, and wide enough to hold them.
std::vector<double> place_knots(std::span<const double> v, Index count, KnotPlacement placement);

/// Finds the piece that an input falls in: the number of knots at or below it, 0 .. count.
///
/// Piece 0 lies left of all knots and piece `count` right of them. Equal buckets over the range lead to the
/// neighbourhood in one multiplication; a walk of mostly no step ends the search.
struct PieceFinder {
  const double* knots;
  const std::uint16_t* first_piece;
  double lower;
  double buckets_per_unit;
  std::int32_t last_bucket;
  std::int32_t count;

  std::int32_t operator()(double u) const {
    const double place = (u - lower) * buckets_per_unit;
    // The comparisons put what is not a number into the first bucket.
    const std::int32_t bucket =
        place > 0.0 ? (place < last_bucket ? static_cast<std::int32_t>(place) : last_bucket) : 0;
    std::int32_t piece = first_piece[bucket];
    while (piece < count && knots[piece] <= u) ++piece;
    while (piece > 0 && knots[piece - 1] > u) --piece;
    return piece;
  }
};

/// Strictly increasing knots, an immutable value. Either settled, or a wish for a number of knots that lie uniformly on
/// [-1, 1] until adapted_to() places them.
class Knots {
 public:
  static constexpr Index kMaxCount = 1000;

  /// `block` is the name in error messages. Throws Error unless 2 <= count <= 1000.
  Knots(const char* block, Index count, KnotPlacement placement);
  /// Settled, uniform over the range. Throws Error likewise, and unless range.lower < range.upper.
  Knots(const char* block, Index count, SignalRange range);
  /// Settled. Throws Error unless there are 2 .. 1000 finite, strictly increasing knots.
  Knots(const char* block, std::vector<double> knots);

  Index count() const { return std::ssize(table_->knots); }
  const std::vector<double>& values() const { return table_->knots; }
  double operator[](Index k) const { return table_->knots[static_cast<std::size_t>(k)]; }
  bool settled() const { return settled_; }
  KnotPlacement placement() const { return placement_; }

  /// `knots=[...]` when settled, `knots=20` and a placement other than mixed when not.
  Arguments arguments() const;

  /// Placed for v; themselves when settled.
  Knots adapted_to(std::span<const double> v) const;
  /// Settled knots at k times the places of these, k != 0; in reverse order for k < 0.
  Knots scaled(double k) const;

  PieceFinder finder() const;

 private:
  struct Table {
    std::vector<double> knots;
    std::vector<std::uint16_t> first_piece;
    double buckets_per_unit;
  };

  Knots(const char* block, std::vector<double> knots, bool settled, KnotPlacement placement);

  const char* block_;
  bool settled_;
  KnotPlacement placement_;
  std::shared_ptr<const Table> table_;
};

}  // namespace blockid
