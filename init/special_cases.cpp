#include <blockid/init/bla.hpp>
#include <blockid/init/special_cases.hpp>
#include <blockid/init/wh_builder.hpp>

namespace blockid {
namespace {

/// Samples of each record that rank the candidates.
constexpr Index kRankingSamples = 20000;

std::vector<Candidate> cases(const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options) {
  const DataSet part = first_samples(data, kRankingSamples, options.prediction.warmup);
  const WienerHammersteinBuilder builder(chain, "wiener_and_hammerstein", part, options.prediction);
  const Rational* g_w = builder.structure().g_w();
  const Rational* g_h = builder.structure().g_h();
  if (g_w == nullptr || g_h == nullptr) return {};
  const Index delay = g_w->nk() + g_h->nk();
  BlaOptions settings;
  settings.prediction = options.prediction;
  settings.progress = options.progress;
  // The delay stays where the chain has it: what is identified here is the filter behind it.
  const auto numbers = [&](const Rational& filter) {
    return best_linear_approximation(part, {filter.nb(), filter.na(), delay}, settings).model.parameters;
  };
  std::vector<Candidate> candidates;
  candidates.push_back(builder.build(numbers(*g_w), g_h->initial_parameters(), "Wiener: all dynamics before f"));
  candidates.push_back(builder.build(g_w->initial_parameters(), numbers(*g_h), "Hammerstein: all dynamics behind f"));
  return builder.finished(std::move(candidates), 2);
}

}  // namespace

Initialiser wiener_and_hammerstein() { return cases; }

}  // namespace blockid
