// What an initialiser is: a function from data to ranked starting models.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>
#include <blockid/data/data_set.hpp>
#include <blockid/estimators/predictor.hpp>

#include <complex>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace blockid {

/// A real root, or the upper one of a pair, that an initialiser shared out between the two filters of a chain.
struct RootShare {
  bool pole = true;
  std::complex<double> value = 0.0;
  /// Share of G_W that was fitted: 1 the whole root, 0 none of it.
  double exponent = 0.5;
  /// Whether the candidate has it in G_W.
  bool in_first = false;
};

/// A starting model and where it came from.
struct Candidate {
  Model model;
  /// sqrt(sum r^2 / counted samples) of the model as it is, before any refit.
  double rmse = 0.0;
  /// In words, e.g. "split 3 of 32: poles {0.9} | {0.7+-0.3i}".
  std::string how = {};
  /// Poles, then zeros, by initialisers that fit exponents; otherwise empty.
  std::vector<RootShare> root_shares = {};
  /// Levenberg-Marquardt iterations that the initialiser has spent on these parameters.
  int iterations = 0;
};

/// Best first.
inline bool lower_error(const Candidate& a, const Candidate& b) { return a.rmse < b.rmse; }

/// Where a long computation stands.
struct Progress {
  /// e.g. "best linear approximation", "splits", "refit 2".
  std::string stage = {};
  Index step = 0;
  /// 0 when unknown.
  Index steps = 0;
  /// Best so far in this stage, in units of the output; infinite when there is none yet.
  double rmse = 0.0;
  double elapsed_s = 0.0;
};

/// Called from one thread at a time; false cancels, what was found so far is kept.
using ProgressFunction = std::function<bool(const Progress&)>;

struct InitialiserOptions {
  PredictionOptions prediction = {};
  std::uint64_t seed = 1;
  int threads = 1;
  ProgressFunction progress = {};
};

/// Maps a chain (structure with the wanted orders) and data to candidates, best first. No hidden state: the same
/// arguments give the same candidates, whatever the number of threads.
using Initialiser =
    std::function<std::vector<Candidate>(const AnyBlock& chain, const DataSet& data, const InitialiserOptions&)>;

/// The given model as the only candidate.
Initialiser start_from(Model model);

/// The blocks' own initial parameters, structure adapted to the input, affine parameters by least squares.
Initialiser no_initialiser();

}  // namespace blockid
