#include <blockid/data/error.hpp>
#include <blockid/init/detail/candidate_loop.hpp>
#include <blockid/init/random_starts.hpp>
#include <blockid/init/wh_builder.hpp>

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace blockid {
namespace {

/// Uniform in [0, 1) from the engine's bits, which the C++ standard fixes.
double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11U) * 0x1.0p-53; }

std::vector<RootGroup> random_groups(Index degree, double radius, std::mt19937_64& engine) {
  std::vector<RootGroup> groups;
  for (Index left = degree; left > 0;) {
    const double r = radius * std::sqrt(uniform(engine));
    const double angle = std::numbers::pi * uniform(engine);
    if (left >= 2 && uniform(engine) < 0.5) {
      groups.push_back({RootGroup::Kind::pair, std::polar(r, angle)});
      left -= 2;
    } else {
      groups.push_back({RootGroup::Kind::real, angle < std::numbers::pi / 2.0 ? r : -r});
      left -= 1;
    }
  }
  return groups;
}

Eigen::VectorXd random_filter(const Rational* filter, double radius, std::mt19937_64& engine) {
  if (filter == nullptr) return {};
  const std::vector<RootGroup> zeros = random_groups(filter->nb(), radius, engine);
  const std::vector<RootGroup> poles = random_groups(filter->na(), radius, engine);
  return filter_parameters(*filter, zeros, poles);
}

std::vector<Candidate> drawn(const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options,
                             const RandomStartsOptions& settings) {
  if (settings.starts < 1 || settings.ranking_samples < 0 || !(settings.radius > 0.0) || !(settings.radius < 1.0)) {
    fail("random_starts: starts must be >= 1, ranking_samples >= 0 and the radius within (0, 1)");
  }
  const DataSet part = first_samples(data, settings.ranking_samples, options.prediction.warmup);
  const WienerHammersteinBuilder builder(chain, "random_starts", part, options.prediction);
  std::mt19937_64 engine(options.seed);
  std::vector<std::pair<Eigen::VectorXd, Eigen::VectorXd>> filters;
  for (int k = 0; k < settings.starts; ++k) {
    Eigen::VectorXd first = random_filter(builder.structure().g_w(), settings.radius, engine);
    Eigen::VectorXd second = random_filter(builder.structure().g_h(), settings.radius, engine);
    filters.emplace_back(std::move(first), std::move(second));
  }
  std::vector<Candidate> candidates =
      detail::candidate_loop(filters.size(), "random starts", options, [&](std::size_t k) {
        return builder.build(filters[k].first, filters[k].second,
                             "random start " + std::to_string(k + 1) + " of " + std::to_string(filters.size()));
      });
  return builder.finished(std::move(candidates), settings.starts);
}

}  // namespace

Initialiser random_starts(RandomStartsOptions options) {
  return [options](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    return drawn(chain, data, settings, options);
  };
}

}  // namespace blockid
