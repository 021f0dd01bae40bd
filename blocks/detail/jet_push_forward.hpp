// push_forward for blocks that offer only apply<T>: Ceres Jets, a few columns at a time.
#pragma once

#include <blockid/blocks/block.hpp>

#include <ceres/jet.h>

#include <algorithm>
#include <span>
#include <vector>

namespace blockid {

/// Number of derivatives that one Jet carries through a type-erased block.
inline constexpr int kJetStride = 8;

/// The scalar that type-erased blocks are differentiated with.
using TileJet = ceres::Jet<double, kJetStride>;

namespace detail {

/// Doubles that push_forward_by_jets() remembers between tiles: dx/dp for every column.
inline Index jet_tangent_memory(Index state_count, Index upstream, Index own) {
  return state_count * padded_columns(upstream + own);
}

/// Seeds a constant with a unit derivative when `column` lies within [first, first + kJetStride).
inline TileJet seeded(double value, Index column, Index first) {
  const Index lane = column - first;
  return lane >= 0 && lane < kJetStride ? TileJet(value, static_cast<int>(lane)) : TileJet(value);
}

/// A block with memory: every column passes through the recursion.
template <class B>
void push_dynamic_by_jets(const B& block, std::span<const double> theta, std::span<double> x, std::span<double> memory,
                          std::span<const double> u, std::span<double> y, const Tangents& tangents, Index own) {
  const Index rows = tangents.rows;
  const Index columns = tangents.upstream + own;
  const Index memory_stride = padded_columns(columns);
  std::vector<TileJet> theta_jets(theta.size());
  std::vector<TileJet> x_jets(x.size());
  std::vector<TileJet> u_jets(u.size());
  std::vector<TileJet> y_jets(y.size());
  for (Index first = 0; first < std::max<Index>(columns, 1); first += kJetStride) {
    const int lanes = static_cast<int>(std::min<Index>(kJetStride, columns - first));
    for (std::size_t k = 0; k < theta.size(); ++k) {
      theta_jets[k] = seeded(theta[k], tangents.upstream + static_cast<Index>(k), first);
    }
    for (std::size_t k = 0; k < x.size(); ++k) {
      x_jets[k] = TileJet(x[k]);
      for (int lane = 0; lane < lanes; ++lane) {
        x_jets[k].v[lane] =
            memory[k * static_cast<std::size_t>(memory_stride) + static_cast<std::size_t>(first + lane)];
      }
    }
    for (Index t = 0; t < rows; ++t) {
      TileJet& input = u_jets[static_cast<std::size_t>(t)];
      input = TileJet(u[static_cast<std::size_t>(t)]);
      for (int lane = 0; lane < lanes && first + lane < tangents.upstream; ++lane) {
        input.v[lane] = tangents.row(t)[first + lane];
      }
    }
    block.apply(std::span<const TileJet>(theta_jets), std::span<TileJet>(x_jets), std::span<const TileJet>(u_jets),
                std::span<TileJet>(y_jets));
    for (Index t = 0; t < rows; ++t) {
      const TileJet& output = y_jets[static_cast<std::size_t>(t)];
      y[static_cast<std::size_t>(t)] = output.a;
      for (int lane = 0; lane < lanes; ++lane) tangents.row(t)[first + lane] = output.v[lane];
    }
    for (std::size_t k = 0; k < x.size(); ++k) {
      for (int lane = 0; lane < lanes; ++lane) {
        memory[k * static_cast<std::size_t>(memory_stride) + static_cast<std::size_t>(first + lane)] =
            x_jets[k].v[lane];
      }
    }
  }
  for (std::size_t k = 0; k < x.size(); ++k) x[k] = x_jets[k].a;
}

/// A static block: only du and dtheta need a seed, upstream columns follow by the chain rule.
template <class B>
void push_static_by_jets(const B& block, std::span<const double> theta, std::span<const double> u, std::span<double> y,
                         const Tangents& tangents) {
  const Index own = static_cast<Index>(theta.size());
  std::vector<TileJet> theta_jets(theta.size());
  std::vector<TileJet> u_jets(u.size());
  std::vector<TileJet> y_jets(y.size());
  std::vector<double> slope(u.size());
  for (Index first = 0; first < own + 1; first += kJetStride) {
    for (std::size_t k = 0; k < theta.size(); ++k) {
      theta_jets[k] = seeded(theta[k], static_cast<Index>(k), first);
    }
    for (std::size_t t = 0; t < u.size(); ++t) u_jets[t] = seeded(u[t], own, first);
    block.apply(std::span<const TileJet>(theta_jets), std::span<TileJet>(), std::span<const TileJet>(u_jets),
                std::span<TileJet>(y_jets));
    for (std::size_t t = 0; t < u.size(); ++t) {
      double* target = tangents.own(static_cast<Index>(t));
      for (Index lane = 0; lane < kJetStride && first + lane <= own; ++lane) {
        const double derivative = y_jets[t].v[static_cast<int>(lane)];
        if (first + lane == own) {
          slope[t] = derivative;
        } else {
          target[first + lane] = derivative;
        }
      }
      y[t] = y_jets[t].a;
    }
  }
  for (Index t = 0; t < tangents.rows; ++t) {
    for (Index c = 0; c < tangents.upstream; ++c) tangents.row(t)[c] *= slope[static_cast<std::size_t>(t)];
  }
}

}  // namespace detail
}  // namespace blockid
