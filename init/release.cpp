#include <blockid/blocks/detail/view.hpp>
#include <blockid/blocks/fir.hpp>
#include <blockid/blocks/fractional_filter.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/data/error.hpp>
#include <blockid/estimators/refit.hpp>
#include <blockid/init/detail/candidate_loop.hpp>
#include <blockid/init/detail/short_expansion.hpp>
#include <blockid/init/exponent_starts.hpp>
#include <blockid/init/fractional_chain.hpp>
#include <blockid/init/release.hpp>
#include <blockid/init/starting_bla.hpp>
#include <blockid/init/wh_builder.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>
#include <utility>

namespace blockid {
namespace {

using detail::view;

constexpr Index kFewestCoefficients = 20;
/// Unknowns for each sample that a free expansion may use up.
constexpr double kCoefficientsPerSample = 0.1;
/// Levenberg-Marquardt iterations of a reduction, which has next to no noise.
constexpr int kReductionIterations = 40;

/// Roots of a filter whose impulse response squared has the given ones: their square roots.
FractionalRoots square_roots(FractionalRoots roots) {
  for (auto* list : {&roots.poles, &roots.zeros}) {
    for (std::complex<double>& root : *list) root = std::sqrt(root);
  }
  return roots;
}

/// One release: the chain with free coefficients and how it is reduced.
class Releaser {
 public:
  Releaser(const WienerHammersteinBuilder& builder, const DataSet& data, const StartingBla& start,
           const InitialiserOptions& options, const ReleaseOptions& release_options)
      : builder_(builder),
        structure_(builder.structure()),
        data_(data),
        options_(options),
        release_(release_options),
        roots_(expandable_roots(start.bla.poles, start.bla.zeros)),
        first_roots_(start.squared ? square_roots(roots_.finite) : roots_.finite),
        squared_(start.squared),
        length_(length(start.bla)) {}

  const ExpandableRoots& roots() const { return roots_; }

  std::optional<Candidate> candidate(const ExponentStart& start) const {
    RefitOptions settings;
    settings.prediction = options_.prediction;
    settings.max_iterations = release_.iterations;
    settings.covariance = false;
    const RefitReport report = refit(free_model(start), data_, settings);
    if (!std::isfinite(report.rmse)) return std::nullopt;
    return reduced(report.model, (squared_ ? "release from u^2, exponents " : "release from exponents ") + start.text);
  }

 private:
  Index length(const BestLinearApproximation& bla) const {
    if (release_.coefficients > 0) return release_.coefficients;
    const Index wanted = detail::short_expansion_length(bla.poles);
    const auto affordable = static_cast<Index>(kCoefficientsPerSample * static_cast<double>(total_samples(data_)));
    return std::max<Index>(std::min(std::max(wanted, kFewestCoefficients), affordable), 1);
  }

  /// Coefficients of one side's expansion behind the delay by infinite zeros that belong to it: (length + 1,).
  Eigen::VectorXd expansion(const FractionalRoots& roots, const Eigen::VectorXd& exponents, Index delay) const {
    const Index shift = std::min(delay, length_);
    const FractionalFilter filter(roots, length_ - shift);
    Eigen::VectorXd h = Eigen::VectorXd::Zero(length_ + 1);
    h.tail(length_ + 1 - shift) = filter.coefficients(view(exponents));
    return h;
  }

  /// FIR | f | FIR with f placed and fitted; a filter that the chain lacks leaves its exponents to the other.
  Model free_model(const ExponentStart& start) const {
    const Rational* g_w = structure_.g_w();
    const Rational* g_h = structure_.g_h();
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(start.exponents.size());
    const Eigen::VectorXd in_first = g_h == nullptr ? ones : start.exponents;
    const Eigen::VectorXd in_second = g_w == nullptr ? ones : ones - start.exponents;
    std::vector<LabelledBlock> row;
    std::vector<double> theta;
    Eigen::VectorXd v = data_.records.front().u;
    const auto append = [&](const char* name, const AnyBlock& block, const Eigen::VectorXd& numbers) {
      row.push_back({name, block});
      theta.insert(theta.end(), numbers.begin(), numbers.end());
    };
    if (g_w != nullptr) {
      const Fir fir(length_, g_w->nk());
      Eigen::VectorXd h = expansion(first_roots_, in_first, g_h == nullptr || start.delay_first ? roots_.infinite : 0);
      Model filter = make_model(fir);
      filter.parameters = h;
      v = simulate(filter, v);
      const double deviation = std::sqrt((v.array() - v.mean()).square().mean());
      if (std::isfinite(deviation) && deviation > 0.0) {
        h /= deviation;
        v /= deviation;
      }
      append("W", fir, h);
    }
    const AnyBlock f = builder_.affine_static_block().adapted_to(view(v));
    append("f", f, f.initial_parameters());
    if (g_h != nullptr) {
      append("H", Fir(length_, g_h->nk()),
             expansion(roots_.finite, in_second, g_w == nullptr || !start.delay_first ? roots_.infinite : 0));
    }
    Model model = make_model(Series(std::move(row)), data_.records.front().sample_time_s);
    model.parameters = Eigen::Map<const Eigen::VectorXd>(theta.data(), static_cast<Index>(theta.size()));
    return fit_static(model, data_, options_.prediction).model;
  }

  /// theta of the rational filter that best takes the signal `in` to `out`; nothing when the signals are of no use.
  std::optional<Eigen::VectorXd> reduction(const Rational& wanted, std::vector<Eigen::VectorXd> in,
                                           std::vector<Eigen::VectorXd> out) const {
    DataSet signals;
    for (std::size_t k = 0; k < in.size(); ++k) {
      Record record = data_.records[k];
      record.u = std::move(in[k]);
      record.y = std::move(out[k]);
      if (!record.u.allFinite() || !record.y.allFinite()) return std::nullopt;
      signals.records.push_back(std::move(record));
    }
    BlaOptions settings;
    settings.prediction = options_.prediction;
    settings.max_iterations = kReductionIterations;
    const BestLinearApproximation found =
        best_linear_approximation(signals, {wanted.nb(), wanted.na(), wanted.nk()}, settings);
    if (!std::isfinite(found.rmse)) return std::nullopt;
    return found.model.parameters;
  }

  std::optional<Candidate> reduced(const Model& free, std::string how) const {
    const std::size_t filters = structure_.g_w() != nullptr ? 1 : 0;
    std::vector<std::vector<Eigen::VectorXd>> signals;
    for (const Record& record : data_.records) signals.push_back(simulate_signals(free, record.u));
    const auto at = [&](std::size_t place) {
      std::vector<Eigen::VectorXd> result;
      for (const std::vector<Eigen::VectorXd>& of_record : signals) result.push_back(of_record[place]);
      return result;
    };
    Eigen::VectorXd first;
    Eigen::VectorXd second;
    try {
      if (const Rational* g_w = structure_.g_w()) {
        const std::optional<Eigen::VectorXd> found = reduction(*g_w, at(0), at(1));
        if (!found) return std::nullopt;
        first = *found;
      }
      if (const Rational* g_h = structure_.g_h()) {
        const std::optional<Eigen::VectorXd> found = reduction(*g_h, at(filters + 1), at(filters + 2));
        if (!found) return std::nullopt;
        second = *found;
      }
    } catch (const Error&) {
      return std::nullopt;  // a constant signal: this start has died
    }
    return builder_.build(first, second, std::move(how));
  }

  const WienerHammersteinBuilder& builder_;
  const WienerHammersteinStructure& structure_;
  const DataSet& data_;
  const InitialiserOptions& options_;
  ReleaseOptions release_;
  ExpandableRoots roots_;
  /// Those that G_W is expanded with.
  FractionalRoots first_roots_;
  bool squared_;
  Index length_;
};

std::vector<Candidate> released(const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options,
                                const ReleaseOptions& settings) {
  if (settings.coefficients < 0 || settings.starts < 1 || settings.iterations < 1 || settings.samples < 0) {
    fail("release: starts and iterations must be >= 1, coefficients and samples >= 0");
  }
  const DataSet part = first_samples(data, settings.samples, options.prediction.warmup);
  const WienerHammersteinBuilder builder(chain, "release", part, options.prediction);
  const StartingBla start = starting_bla(data, joint_orders(builder.structure()), options);
  if (start.bla.refit.status == FitStatus::cancelled) return {};
  const Releaser releaser(builder, part, start, options, settings);
  const std::vector<ExponentStart> starts = exponent_starts(releaser.roots(), settings.starts, options.seed);
  std::vector<Candidate> candidates = detail::candidate_loop(
      starts.size(), "release", options, [&](std::size_t k) { return releaser.candidate(starts[k]); });
  return builder.finished(std::move(candidates), settings.starts);
}

}  // namespace

Initialiser release(ReleaseOptions options) {
  return [options](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& settings) {
    return released(chain, data, settings, options);
  };
}

}  // namespace blockid
