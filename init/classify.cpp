#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/init/classify.hpp>
#include <blockid/init/detail/candidate_loop.hpp>
#include <blockid/init/detail/repeated.hpp>
#include <blockid/init/detail/short_expansion.hpp>
#include <blockid/init/exponent_starts.hpp>
#include <blockid/init/fractional_chain.hpp>
#include <blockid/init/starting_bla.hpp>
#include <blockid/init/wh_builder.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>
#include <utility>

namespace blockid {
namespace {

using detail::view;

/// A root with its exponent in G_W.
struct SharedOut {
  RootGroup group;
  double exponent;
};

/// Which roots go to G_W, and sum (rounded - exponent)^2.
struct Rounding {
  double distance = 0.0;
  std::vector<bool> first = {};
};

bool nearer(const Rounding& a, const Rounding& b) { return a.distance < b.distance; }

/// The `count` nearest roundings of roots with total degree `wanted` in G_W; dynamic programming over the roots, the
/// degrees reached so far being the state.
std::vector<Rounding> nearest_roundings(const std::vector<SharedOut>& roots, Index wanted, Index count) {
  std::vector<std::vector<Rounding>> of_degree(static_cast<std::size_t>(wanted) + 1);
  of_degree[0].push_back({});
  for (const SharedOut& root : roots) {
    std::vector<std::vector<Rounding>> next(of_degree.size());
    for (std::size_t degree = 0; degree < of_degree.size(); ++degree) {
      for (const Rounding& so_far : of_degree[degree]) {
        for (const bool first : {false, true}) {
          const std::size_t reached = degree + (first ? static_cast<std::size_t>(root.group.degree()) : 0);
          if (reached >= next.size()) continue;
          const double error = (first ? 1.0 : 0.0) - root.exponent;
          Rounding longer = so_far;
          longer.distance += error * error;
          longer.first.push_back(first);
          next[reached].push_back(std::move(longer));
        }
      }
    }
    for (std::vector<Rounding>& list : next) {
      std::stable_sort(list.begin(), list.end(), nearer);
      if (std::ssize(list) > count) list.erase(list.begin() + count, list.end());
    }
    of_degree = std::move(next);
  }
  return of_degree.back();
}

/// The most damped pair as two real roots of the same exponent; false when there is no pair.
bool break_a_pair(std::vector<SharedOut>& roots) {
  const auto angle = [](const SharedOut& root) {
    return root.group.kind == RootGroup::Kind::pair ? std::abs(std::arg(root.group.value))
                                                    : std::numeric_limits<double>::infinity();
  };
  const auto pair = std::min_element(roots.begin(), roots.end(),
                                     [&](const SharedOut& a, const SharedOut& b) { return angle(a) < angle(b); });
  if (pair == roots.end() || pair->group.kind != RootGroup::Kind::pair) return false;
  const double exponent = pair->exponent;
  const std::vector<RootGroup> halves = broken_pair(pair->group);
  roots.erase(pair);
  for (const RootGroup& half : halves) roots.push_back({half, exponent});
  return true;
}

/// Roundings that fit the degree; pairs are broken until there is one.
std::vector<Rounding> fitting_roundings(std::vector<SharedOut>& roots, Index wanted, Index count) {
  for (;;) {
    std::vector<Rounding> found = nearest_roundings(roots, wanted, count);
    if (!found.empty() || !break_a_pair(roots)) return found;
  }
}

std::vector<RootGroup> chosen(const std::vector<SharedOut>& roots, const Rounding& rounding, bool first) {
  std::vector<RootGroup> result;
  for (std::size_t k = 0; k < roots.size(); ++k) {
    if (rounding.first[k] == first) result.push_back(roots[k].group);
  }
  return result;
}

/// What a rounding made of the roots; those at infinity have no place.
void add_shares(std::vector<RootShare>& shares, bool pole, const std::vector<SharedOut>& roots,
                const Rounding& rounding) {
  for (std::size_t k = 0; k < roots.size(); ++k) {
    if (roots[k].group.kind == RootGroup::Kind::infinite) continue;
    shares.push_back({pole, roots[k].group.value, roots[k].exponent, rounding.first[k]});
  }
}

/// Fractional fits and their roundings for one chain with two filters.
class Classifier {
 public:
  Classifier(const WienerHammersteinBuilder& builder, const DataSet& data, const BestLinearApproximation& bla,
             const InitialiserOptions& options, const ClassifyOptions& settings)
      : builder_(builder),
        data_(data),
        bla_(bla),
        options_(options),
        settings_(settings),
        roots_(expandable_roots(bla.poles, bla.zeros)) {
    for (const std::complex<double>& pole : roots_.finite.poles) inner_poles_.push_back(group_of(pole));
    const Index wanted = detail::short_expansion_length(inner_poles_);
    length_ = settings.coefficients > 0 ? settings.coefficients : wanted;
    double sum = 0.0;
    Index count = 0;
    for (const Record& record : data.records) {
      sum += (record.y.array().isFinite()).select((record.y.array() - bla.output_mean).square(), 0.0).sum();
      count += record.y.size();
    }
    output_deviation_ = std::sqrt(sum / static_cast<double>(std::max<Index>(count, 1)));
  }

  const ExpandableRoots& roots() const { return roots_; }

  /// Models of the nearest roundings of one fractional fit.
  std::vector<Candidate> candidates(const ExponentStart& start) const {
    const Eigen::VectorXd exponents = fitted_exponents(start.exponents);
    if (!exponents.allFinite()) return {};
    std::vector<SharedOut> poles;
    for (const RootGroup& pole : bla_.poles) poles.push_back({pole, exponents[std::ssize(poles)]});
    std::vector<SharedOut> zeros;
    Index next = std::ssize(poles);
    for (const RootGroup& zero : bla_.zeros) {
      // Delays stand in front of the whole chain: nothing tells where they belong.
      zeros.push_back({zero, zero.kind == RootGroup::Kind::infinite ? 0.5 : exponents[next++]});
    }
    return rounded(poles, zeros, "classified from exponents " + start.text + " -> " + text_of(exponents));
  }

 private:
  static RootGroup group_of(std::complex<double> root) {
    return {root.imag() != 0.0 ? RootGroup::Kind::pair : RootGroup::Kind::real, root};
  }

  std::string text_of(const Eigen::VectorXd& exponents) const {
    std::string text;
    for (Index k = 0; k < exponents.size(); ++k) {
      if (k == std::ssize(bla_.poles)) text += " |";
      const double shown = std::round(exponents[k] * 100.0) / 100.0;
      text += (text.empty() ? "" : " ") + std::to_string(shown).substr(0, shown < 0.0 ? 5 : 4);
    }
    return text;
  }

  /// The fractional chain at these exponents, f placed for the signal that reaches it and fitted.
  Model fractional_model(const Eigen::VectorXd& exponents) const {
    const Index delay = joint_orders(builder_.structure()).nk;
    const FractionalFilter first(roots_.finite, length_, length_, delay + roots_.infinite);
    Model filter = make_model(first);
    filter.parameters = exponents;
    const Eigen::VectorXd v = simulate(filter, data_.records.front().u);
    const AnyBlock f = builder_.affine_static_block().adapted_to(view(v));
    Model model = make_model(fractional_chain(inner_poles_, bla_.zeros, f, {.n = length_, .nk = delay}),
                             data_.records.front().sample_time_s);
    model.parameters.head(exponents.size()) = exponents;
    return fit_static(model, data_, options_.prediction).model;
  }

  /// Not a number when the fit has no finite predictions. f is placed anew half-way.
  Eigen::VectorXd fitted_exponents(Eigen::VectorXd exponents) const {
    const Index count = exponents.size();
    for (int half = 0; half < 2; ++half) {
      const Model start = fractional_model(exponents);
      RefitOptions settings;
      settings.prediction = options_.prediction;
      settings.max_iterations = std::max(settings_.iterations / 2, 1);
      settings.covariance = false;
      const std::vector<std::string> names = start.chain.parameter_names();
      for (Index k = 0; k < count && settings_.pull > 0.0; ++k) {
        settings.penalties.push_back({names[static_cast<std::size_t>(k)], 0.5, settings_.pull * output_deviation_});
      }
      const RefitReport report = refit(start, data_, settings);
      if (!std::isfinite(report.rmse)) return Eigen::VectorXd::Constant(count, std::nan(""));
      exponents = report.model.parameters.head(count);
    }
    return exponents;
  }

  std::vector<Candidate> rounded(std::vector<SharedOut> poles, std::vector<SharedOut> zeros,
                                 const std::string& how) const {
    const Rational& g_w = *builder_.structure().g_w();
    const Rational& g_h = *builder_.structure().g_h();
    const std::vector<Rounding> of_poles = fitting_roundings(poles, g_w.na(), settings_.neighbours);
    const std::vector<Rounding> of_zeros = fitting_roundings(zeros, g_w.nb(), settings_.neighbours);
    struct RoundingPair {
      double distance;
      const Rounding* poles;
      const Rounding* zeros;
    };
    std::vector<RoundingPair> pairs;
    for (const Rounding& p : of_poles) {
      for (const Rounding& z : of_zeros) pairs.push_back({p.distance + z.distance, &p, &z});
    }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const RoundingPair& a, const RoundingPair& b) { return a.distance < b.distance; });
    if (std::ssize(pairs) > settings_.neighbours) pairs.erase(pairs.begin() + settings_.neighbours, pairs.end());
    std::vector<Candidate> candidates;
    for (const RoundingPair& pair : pairs) {
      candidates.push_back(
          builder_.build(filter_parameters(g_w, chosen(zeros, *pair.zeros, true), chosen(poles, *pair.poles, true)),
                         filter_parameters(g_h, chosen(zeros, *pair.zeros, false), chosen(poles, *pair.poles, false)),
                         how + ", rounding " + std::to_string(candidates.size() + 1)));
      add_shares(candidates.back().root_shares, true, poles, *pair.poles);
      add_shares(candidates.back().root_shares, false, zeros, *pair.zeros);
    }
    return candidates;
  }

  const WienerHammersteinBuilder& builder_;
  const DataSet& data_;
  const BestLinearApproximation& bla_;
  const InitialiserOptions& options_;
  ClassifyOptions settings_;
  ExpandableRoots roots_;
  std::vector<RootGroup> inner_poles_;
  Index length_ = 0;
  double output_deviation_ = 0.0;
};

std::vector<Candidate> classified(const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options,
                                  const ClassifyOptions& settings) {
  if (settings.starts < 1 || settings.iterations < 1 || settings.neighbours < 1 || settings.samples < 0 ||
      settings.coefficients < 0 || !(settings.pull >= 0.0)) {
    fail("classify: starts, iterations and neighbours must be >= 1, pull, coefficients and samples >= 0");
  }
  const DataSet part = first_samples(data, settings.samples, options.prediction.warmup);
  const WienerHammersteinBuilder builder(chain, "classify", part, options.prediction);
  if (builder.structure().g_w() == nullptr || builder.structure().g_h() == nullptr) {
    fail("classify: expected a chain with two filters; with one there is nothing to share out (use the split)");
  }
  const StartingBla start = starting_bla(data, joint_orders(builder.structure()), options);
  if (start.bla.refit.status == FitStatus::cancelled || start.squared) return {};
  const Classifier classifier(builder, part, start.bla, options, settings);
  const std::vector<ExponentStart> starts = exponent_starts(classifier.roots(), settings.starts, options.seed);
  std::vector<std::vector<Candidate>> of_start(starts.size());
  detail::candidate_loop(starts.size(), "classify", options, [&](std::size_t k) -> std::optional<Candidate> {
    of_start[k] = classifier.candidates(starts[k]);
    const auto best = std::min_element(of_start[k].begin(), of_start[k].end(), lower_error);
    if (best == of_start[k].end()) return std::nullopt;
    return *best;
  });
  std::vector<Candidate> all;
  for (std::vector<Candidate>& some : of_start) std::move(some.begin(), some.end(), std::back_inserter(all));
  return builder.finished(detail::without_repeated(std::move(all)), settings.starts * settings.neighbours);
}

}  // namespace

Initialiser classify(ClassifyOptions options) {
  return [options](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    return classified(chain, data, settings, options);
  };
}

}  // namespace blockid
