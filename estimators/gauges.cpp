#include <blockid/estimators/gauges.hpp>

#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/oversampled.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/series.hpp>

#include <algorithm>
#include <optional>

namespace blockid {
namespace {

using detail::view;

/// One block of a row with its numbers.
struct Link {
  std::string label;
  AnyBlock block;
  Eigen::VectorXd theta;
  Index offset;
  /// (n_x,) initial state.
  Eigen::VectorXd x;
};

std::vector<Link> links(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x) {
  std::vector<Link> result;
  Index offset = 0;
  Index first_state = 0;
  for (const LabelledBlock& child : block.children()) {
    const Index count = child.block.parameter_count();
    const Index states = child.block.state_count();
    result.push_back({child.label, child.block, theta.segment(offset, count), offset, x.segment(first_state, states)});
    offset += count;
    first_state += states;
  }
  return result;
}

bool has_gain(const Link& link) { return link.block.is_linear() && link.block.gain_parameter(view(link.theta)); }

/// Delays, and static blocks of fixed slope whose levels follow, pass a gain on without taking it.
bool passes_gain(const Link& link) {
  if (link.block.is_linear()) return link.block.parameter_count() == 0;
  return link.block.with_scaled_signals(view(link.theta), 1.0).has_value();
}

enum class Side { input, output };

/// Who takes up the gain that a linear block gives away.
struct Absorber {
  std::size_t position;
  Side side;
};

std::optional<Absorber> absorber_of(const std::vector<Link>& row, std::size_t position) {
  std::size_t next = position + 1;
  while (next < row.size() && passes_gain(row[next])) ++next;
  if (next < row.size()) {
    if (has_gain(row[next])) return Absorber{next, Side::output};
    if (!row[next].block.is_linear() && row[next].block.with_scaled_input(view(row[next].theta), 1.0)) {
      return Absorber{next, Side::input};
    }
  }
  std::size_t before = position;
  while (before > 0 && passes_gain(row[before - 1])) --before;
  if (before == 0) return std::nullopt;
  const Link& previous = row[before - 1];
  if (!previous.block.is_linear() && previous.block.with_scaled_output(view(previous.theta), 1.0)) {
    return Absorber{before - 1, Side::output};
  }
  return std::nullopt;
}

/// How many gauges the frozen parameters of a block fix: a frozen number that is not zero fixes one, but a linear block
/// or one of fixed slope has a single gain to fix, a static block one at its input and one at its output.
Index fixed_gains(const Link& link, Index first, const std::vector<Index>& frozen) {
  const auto tells_gain = [&](Index own, const std::optional<Rescaled>& doubled) {
    return doubled && doubled->parameters[own] != link.theta[own];
  };
  const std::optional<Rescaled> output = link.block.with_scaled_output(view(link.theta), 2.0);
  const std::optional<Rescaled> signals = link.block.with_scaled_signals(view(link.theta), 2.0);
  const Index count = std::count_if(frozen.begin(), frozen.end(), [&](Index k) {
    const Index own = k - first;
    return own >= 0 && own < link.theta.size() && (tells_gain(own, output) || tells_gain(own, signals));
  });
  return std::min<Index>(count, link.block.is_linear() || signals ? 1 : 2);
}

/// Whether a frozen parameter between giver and taker, both included, fixes their gauge; one that does is used up.
bool take_fixed_gain(std::vector<Index>& fixed, std::size_t giver, std::size_t taker) {
  const auto [first, last] = std::minmax(giver, taker);
  for (std::size_t k = first; k <= last; ++k) {
    if (fixed[k] == 0) continue;
    --fixed[k];
    return true;
  }
  return false;
}

/// Gauges of one row; `base` is its place in theta.
void collect_row(const std::vector<Link>& row, Index base, const std::vector<Index>& frozen, std::vector<Index>& held) {
  std::vector<Index> fixed;
  fixed.reserve(row.size());
  for (const Link& link : row) fixed.push_back(fixed_gains(link, base + link.offset, frozen));
  for (std::size_t k = 0; k < row.size(); ++k) {
    const std::optional<Absorber> absorber = has_gain(row[k]) ? absorber_of(row, k) : std::nullopt;
    if (!absorber || take_fixed_gain(fixed, k, absorber->position)) continue;
    held.push_back(base + row[k].offset + *row[k].block.gain_parameter(view(row[k].theta)));
  }
}

void collect(const AnyBlock& block, const Eigen::VectorXd& theta, Index base, const std::vector<Index>& frozen,
             std::vector<Index>& held) {
  if (const auto* oversampled = block.target<Oversampled>()) {
    collect(oversampled->inner(), theta, base, frozen, held);
    return;
  }
  const std::vector<Link> row = links(block, theta, Eigen::VectorXd::Zero(block.state_count()));
  if (block.target<Series>() != nullptr) collect_row(row, base, frozen, held);
  for (const Link& link : row) collect(link.block, link.theta, base + link.offset, frozen, held);
}

/// The blocks strictly between giver and taker with their signals times k; nothing when one cannot follow.
std::optional<std::vector<Rescaled>> passed_on(const std::vector<Link>& row, std::size_t first, std::size_t last,
                                               double k) {
  std::vector<Rescaled> result;
  for (std::size_t i = first + 1; i < last; ++i) {
    if (row[i].block.is_linear()) {
      result.push_back({row[i].block, row[i].theta});
    } else if (const std::optional<Rescaled> scaled = row[i].block.with_scaled_signals(view(row[i].theta), k)) {
      result.push_back(*scaled);
    } else {
      return std::nullopt;
    }
  }
  return result;
}

/// Scales the gain of row[position] to one; its absorber takes the inverse.
void move_gain(std::vector<Link>& row, std::size_t position, const Absorber& absorber) {
  Link& giver = row[position];
  Link& taker = row[absorber.position];
  const Index held = *giver.block.gain_parameter(view(giver.theta));
  const double gain = giver.theta[held];
  if (gain == 0.0) return;
  const bool forward = absorber.position > position;
  const auto [first, last] = std::minmax(position, absorber.position);
  // What lies between giver and taker shrinks with the giver's output, or grows with the taker's.
  const double between = forward ? 1.0 / gain : gain;
  const std::optional<std::vector<Rescaled>> passed = passed_on(row, first, last, between);
  const std::optional<Rescaled> given = giver.block.with_scaled_output(view(giver.theta), 1.0 / gain);
  const std::optional<Rescaled> taken = absorber.side == Side::input
                                            ? taker.block.with_scaled_input(view(taker.theta), 1.0 / gain)
                                            : taker.block.with_scaled_output(view(taker.theta), gain);
  if (!given || !taken || !passed) return;
  giver.block = given->block;
  giver.theta = given->parameters;
  giver.theta[held] = 1.0;  // x (1 / x) may miss one by a rounding
  taker.block = taken->block;
  taker.theta = taken->parameters;
  for (std::size_t k = first + 1; k < last; ++k) {
    row[k].block = (*passed)[k - first - 1].block;
    row[k].theta = (*passed)[k - first - 1].parameters;
  }
  for (std::size_t k = first; k <= last; ++k) {
    // Filters remember in units of their output; oversampled blocks remember inputs.
    const bool remembers_inputs = row[k].block.target<Oversampled>() != nullptr;
    const bool input_changes = k > first;
    const bool output_changes = k < last && (forward || k > first);
    if (remembers_inputs ? input_changes : output_changes) row[k].x *= between;
  }
}

struct Normalised {
  AnyBlock block;
  Eigen::VectorXd theta;
  Eigen::VectorXd x;
};

Normalised normalise_block(const AnyBlock& block, const Eigen::VectorXd& theta, const Eigen::VectorXd& x) {
  if (const auto* oversampled = block.target<Oversampled>()) {
    const Index history = oversampled->input_history();
    const Normalised inner = normalise_block(oversampled->inner(), theta, x.tail(x.size() - history));
    Eigen::VectorXd states = x;
    states.tail(inner.x.size()) = inner.x;
    return {oversampled->around(inner.block), inner.theta, states};
  }
  std::vector<Link> row = links(block, theta, x);
  if (row.empty()) return {block, theta, x};
  for (Link& link : row) {
    const Normalised inner = normalise_block(link.block, link.theta, link.x);
    link.block = inner.block;
    link.theta = inner.theta;
    link.x = inner.x;
  }
  const bool is_row = block.target<Series>() != nullptr;
  if (is_row) {
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (!has_gain(row[k])) continue;
      if (const std::optional<Absorber> absorber = absorber_of(row, k)) move_gain(row, k, *absorber);
    }
  }
  std::vector<LabelledBlock> children;
  Eigen::VectorXd joined(theta.size());
  Eigen::VectorXd states(x.size());
  Index first_state = 0;
  for (const Link& link : row) {
    joined.segment(link.offset, link.theta.size()) = link.theta;
    states.segment(first_state, link.x.size()) = link.x;
    first_state += link.x.size();
    children.push_back({link.label, link.block});
  }
  if (is_row) return {Series(std::move(children)), joined, states};
  return {Parallel(std::move(children)), joined, states};
}

}  // namespace

std::vector<Index> gain_gauges(const AnyBlock& chain, const Eigen::VectorXd& theta, const std::vector<Index>& frozen) {
  std::vector<Index> held;
  collect(chain, theta, 0, frozen, held);
  std::sort(held.begin(), held.end());
  return held;
}

Model normalise(const Model& model) {
  check(model);
  const bool at_rest = model.initial_state.size() == 0;
  Normalised result = normalise_block(model.chain, model.parameters,
                                      at_rest ? Eigen::VectorXd::Zero(model.chain.state_count()) : model.initial_state);
  Model normalised = model;
  normalised.chain = std::move(result.block);
  normalised.parameters = std::move(result.theta);
  if (!at_rest) normalised.initial_state = std::move(result.x);
  if (normalised.parameters != model.parameters) normalised.standard_deviations.resize(0);
  return normalised;
}

}  // namespace blockid
