#include <blockid/estimators/candidate.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/unknowns.hpp>
#include <blockid/estimators/static_parameters.hpp>

#include <cmath>

namespace blockid {
namespace {

Candidate scored(Model model, const DataSet& data, const PredictionOptions& options, std::string how) {
  const Predictor predictor(model.chain, data, options);
  const double sum = predictor.sum_of_squares(detail::unknowns_of(model, predictor));
  return {std::move(model), std::sqrt(sum / static_cast<double>(predictor.counted_samples())), std::move(how)};
}

}  // namespace

Initialiser start_from(Model model) {
  return [model = std::move(model)](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options) {
    if (chain.parameter_count() != model.chain.parameter_count()) {
      fail("start_from: the chain to fit has ", chain.parameter_count(), " parameters, the given model ",
           model.chain.parameter_count());
    }
    return std::vector<Candidate>{scored(model, data, options.prediction, "given model")};
  };
}

Initialiser no_initialiser() {
  return [](const AnyBlock& chain, const DataSet& data, const InitialiserOptions& options) {
    check(data);
    const Record& first = data.records.front();
    const Model adapted = adapt_structure(make_model(chain, first.sample_time_s), first.u);
    if (affine_parameters(adapted.chain).empty()) {
      return std::vector<Candidate>{scored(adapted, data, options.prediction, "initial parameters of the blocks")};
    }
    const StaticFit fitted = fit_static(adapted, data, options.prediction);
    return std::vector<Candidate>{scored(fitted.model, data, options.prediction,
                                         "initial parameters of the blocks, static block by least squares")};
  };
}

}  // namespace blockid
