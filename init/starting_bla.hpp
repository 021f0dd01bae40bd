// The linear model that a Wiener-Hammerstein start is made from, also where the nonlinearity is even.
#pragma once

#include <blockid/estimators/candidate.hpp>
#include <blockid/init/bla.hpp>

namespace blockid {

/// Share of the output's standard deviation that a best linear approximation must explain to be worth a start.
inline constexpr double kLeastLinearShare = 0.05;

struct StartingBla {
  BestLinearApproximation bla;
  /// True when the best linear approximation vanishes (f even) and `bla` leads from u^2 - mean(u^2) to y instead. For
  /// white Gaussian u its impulse response is that of G_W squared value by value, filtered by G_H: it has the poles of
  /// G_H and products of those of G_W.
  bool squared = false;
};

/// best_linear_approximation(), or that from u^2 when the former explains less than kLeastLinearShare of the output's
/// standard deviation and the latter more.
StartingBla starting_bla(const DataSet& data, const BlaOrders& orders, const InitialiserOptions& options);

}  // namespace blockid
