#include <blockid/blocks/knots.hpp>

#include <blockid/blocks/detail/format.hpp>
#include <blockid/blocks/detail/knot_insertion.hpp>
#include <blockid/blocks/detail/signal_range.hpp>
#include <blockid/data/error.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

constexpr std::array<std::pair<KnotPlacement, std::string_view>, 3> kPlacementNames = {
    {{KnotPlacement::mixed, "mixed"}, {KnotPlacement::uniform, "uniform"}, {KnotPlacement::quantile, "quantile"}}};

void check_count(const char* block, Index count) {
  if (count < 2 || count > Knots::kMaxCount) {
    fail(block, ": the number of knots must lie in 2..", Knots::kMaxCount, ", got ", count);
  }
}

std::vector<double> uniform_knots(SignalRange range, Index count) {
  std::vector<double> knots;
  for (Index k = 0; k < count; ++k) {
    const double part = static_cast<double>(k) / static_cast<double>(count - 1);
    knots.push_back((1.0 - part) * range.lower + part * range.upper);
  }
  return knots;
}

/// Linear interpolation between order statistics; Hyndman and Fan 1996, definition 7.
double quantile(const std::vector<double>& sorted, double level) {
  const double place = level * static_cast<double>(sorted.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(place), sorted.size() - 2);
  const double part = place - static_cast<double>(below);
  return (1.0 - part) * sorted[below] + part * sorted[below + 1];
}

bool strictly_increasing(const std::vector<double>& knots) {
  return std::adjacent_find(knots.begin(), knots.end(), [](double a, double b) { return !(a < b); }) == knots.end();
}

std::vector<double> placed(const char* block, std::span<const double> v, Index count, KnotPlacement placement) {
  check_count(block, count);
  const SignalRange range = detail::range_of(v, block);
  const Index uniform = placement == KnotPlacement::uniform ? count
                        : placement == KnotPlacement::mixed ? std::max<Index>(2, (count + 1) / 2)
                                                            : 2;
  std::vector<double> knots = uniform_knots(range, uniform);
  if (uniform < count) {
    const double spacing = (range.upper - range.lower) / (100.0 * static_cast<double>(count - 1));
    std::vector<double> sorted(v.begin(), v.end());
    std::sort(sorted.begin(), sorted.end());
    for (Index k = 1; k <= count - uniform; ++k) {
      const double level = static_cast<double>(k) / static_cast<double>(count - uniform + 1);
      detail::insert_apart(knots, quantile(sorted, level), spacing);
    }
    while (std::ssize(knots) < count) detail::halve_widest(knots);
  }
  if (!strictly_increasing(knots) || !std::isfinite(range.upper - range.lower)) {
    fail(block, ": its input spans ", detail::number_text(range.lower), " to ", detail::number_text(range.upper),
         ", where ", count, " knots cannot be told apart");
  }
  return knots;
}

}  // namespace

std::string_view name_of(KnotPlacement placement) {
  for (const auto& [value, name] : kPlacementNames) {
    if (value == placement) return name;
  }
  return "";
}

std::optional<KnotPlacement> knot_placement(std::string_view name) {
  for (const auto& [value, known] : kPlacementNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<double> place_knots(std::span<const double> v, Index count, KnotPlacement placement) {
  return placed("knots", v, count, placement);
}

Knots::Knots(const char* block, Index count, KnotPlacement placement)
    : Knots(block, (check_count(block, count), uniform_knots(SignalRange{}, count)), false, placement) {}

Knots::Knots(const char* block, Index count, SignalRange range)
    : Knots(block, (check_count(block, count), detail::check_range(range, block), uniform_knots(range, count)), true,
            KnotPlacement::mixed) {}

Knots::Knots(const char* block, std::vector<double> knots)
    : Knots(block, std::move(knots), true, KnotPlacement::mixed) {}

Knots::Knots(const char* block, std::vector<double> knots, bool settled, KnotPlacement placement)
    : block_(block), settled_(settled), placement_(placement) {
  check_count(block, std::ssize(knots));
  for (std::size_t k = 0; k < knots.size(); ++k) {
    if (!std::isfinite(knots[k])) fail(block, ": knot ", k + 1, " is not finite");
    if (k > 0 && !(knots[k - 1] < knots[k])) {
      fail(block, ": knots must increase strictly, got ", detail::number_text(knots[k - 1]), " before ",
           detail::number_text(knots[k]));
    }
  }
  const double width = knots.back() - knots.front();
  if (!std::isfinite(width) || !std::isfinite(1.0 / width)) fail(block, ": knots span an impossible width of ", width);

  double narrowest = width;
  for (std::size_t k = 1; k < knots.size(); ++k) narrowest = std::min(narrowest, knots[k] - knots[k - 1]);
  // Two buckets in the narrowest interval leave the walk at most one step; more than 4096 would crowd the cache.
  const auto buckets = static_cast<std::size_t>(std::clamp(2.0 * width / narrowest, 16.0, 4096.0));
  std::vector<std::uint16_t> first_piece(buckets);
  for (std::size_t b = 0; b < buckets; ++b) {
    const double edge = knots.front() + width * (static_cast<double>(b) / static_cast<double>(buckets));
    const auto above = std::upper_bound(knots.begin(), knots.end(), edge);
    first_piece[b] = static_cast<std::uint16_t>(above - knots.begin());
  }
  table_ = std::make_shared<const Table>(
      Table{std::move(knots), std::move(first_piece), static_cast<double>(buckets) / width});
}

Arguments Knots::arguments() const {
  if (settled_) return {{"knots", detail::list_text(values())}};
  Arguments result = {{"knots", std::to_string(count())}};
  if (placement_ != KnotPlacement::mixed) result.emplace_back("placement", std::string(name_of(placement_)));
  return result;
}

Knots Knots::adapted_to(std::span<const double> v) const {
  return settled_ ? *this : Knots(block_, placed(block_, v, count(), placement_));
}

Knots Knots::scaled(double k) const {
  std::vector<double> knots = values();
  for (double& knot : knots) knot *= k;
  if (k < 0.0) std::reverse(knots.begin(), knots.end());
  return {block_, std::move(knots)};
}

PieceFinder Knots::finder() const {
  return {table_->knots.data(),
          table_->first_piece.data(),
          table_->knots.front(),
          table_->buckets_per_unit,
          static_cast<std::int32_t>(table_->first_piece.size()) - 1,
          static_cast<std::int32_t>(table_->knots.size())};
}

}  // namespace blockid
