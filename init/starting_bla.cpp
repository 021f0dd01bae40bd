#include <blockid/init/starting_bla.hpp>

#include <cmath>
#include <utility>

namespace blockid {
namespace {

DataSet with_squared_input(DataSet data) {
  for (Record& record : data.records) record.u = record.u.array().square();
  return data;
}

/// sqrt(1 - rmse^2 / var y), 0 when nothing is explained.
double linear_share(const BestLinearApproximation& bla, const DataSet& data) {
  double sum = 0.0;
  Index count = 0;
  for (const Record& record : data.records) {
    for (Index t = 0; t < record.y.size(); ++t) {
      if (!std::isfinite(record.y[t])) continue;
      sum += (record.y[t] - bla.output_mean) * (record.y[t] - bla.output_mean);
      ++count;
    }
  }
  const double variance = count > 0 ? sum / static_cast<double>(count) : 0.0;
  const double explained = 1.0 - bla.rmse * bla.rmse / variance;
  return explained > 0.0 ? std::sqrt(explained) : 0.0;
}

/// Share of the output's standard deviation that a filter of a few coefficients explains by chance.
double share_by_chance(const DataSet& data, const BlaOrders& orders) {
  return std::sqrt(static_cast<double>(orders.nb + orders.na + 1) / static_cast<double>(total_samples(data)));
}

}  // namespace

StartingBla starting_bla(const DataSet& data, const BlaOrders& orders, const InitialiserOptions& options) {
  BlaOptions settings;
  settings.prediction = options.prediction;
  settings.progress = options.progress;
  StartingBla linear{best_linear_approximation(data, orders, settings)};
  if (linear.bla.refit.status == FitStatus::cancelled) return linear;
  const double share = linear_share(linear.bla, data);
  // Three times chance: what is that small in a short record may be nothing.
  if (share >= kLeastLinearShare && share >= 3.0 * share_by_chance(data, orders)) return linear;
  const DataSet squares = with_squared_input(data);
  StartingBla squared{best_linear_approximation(squares, orders, settings), true};
  return linear_share(squared.bla, squares) > share ? std::move(squared) : std::move(linear);
}

}  // namespace blockid
