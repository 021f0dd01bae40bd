// What a problem is: data with everything that is known about them.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/data/data_set.hpp>

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace blockid::problems {

/// A figure that somebody published for a problem, in the problem's metric.
struct PublishedFigure {
  std::string method;
  double value = 0.0;
  std::string unit;
  /// Author, year, table or equation.
  std::string source;
};

/// An identification task. It knows no estimator, so that no estimator can peek at the truth.
struct Problem {
  std::string name;
  std::string description;
  DataSet train;
  DataSet test;
  /// The system that made the data, where it is known.
  std::optional<Model> truth = std::nullopt;
  /// Standard deviation of the noise in the measured output, in `unit`.
  double noise_std = 0.0;
  /// Samples at the start of each record that are not scored.
  Eigen::Index warmup = 0;
  /// Unit of the output, and of the metric: the RMSE of simulation on `test`.
  std::string unit;
  std::vector<PublishedFigure> published = {};
};

}  // namespace blockid::problems
