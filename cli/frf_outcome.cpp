#include <blockid/cli/frf_outcome.hpp>

#include <blockid/blocks/text.hpp>
#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/json_lists.hpp>
#include <blockid/cli/text_table.hpp>

#include <cmath>
#include <ostream>

namespace blockid::cli {
namespace {

using Json = nlohmann::ordered_json;

std::string basis_text(const RationalBasis& basis) {
  const Eigen::VectorXd& points = basis.points;
  switch (basis.kind) {
    case BasisKind::localising:
      return "flbf, " + std::to_string(points.size()) + " break points from " + number(points[0]) + " to " +
             number(points[points.size() - 1]) + " rad/s";
    case BasisKind::kautz:
      return "kautz, frequency " + number(points[0]) + " rad/s, damping ratio " + number(points[1]);
    case BasisKind::laguerre:
      return "laguerre, pole " + number(points[0]) + " rad/s";
    default:
      return blockid::to_text(basis.kind) + ", scale " + number(points[0]) + " rad/s";
  }
}

Json basis_json(const FrequencyFit& fit) {
  const Index n = fit.model.basis.order;
  const Eigen::MatrixXd covariance = known_covariance(fit);
  Json result = {{"kind", blockid::to_text(fit.model.basis.kind)},
                 {"points", numbers_json(fit.model.basis.points)},
                 {"denominator", numbers_json(fit.model.denominator)},
                 {"numerator", numbers_json(fit.model.numerator)}};
  if (covariance.size() > 0) {
    const Eigen::VectorXd deviations = covariance.diagonal().cwiseSqrt();
    result["denominator_standard_deviation"] = numbers_json(deviations.head(n));
    result["numerator_standard_deviation"] = numbers_json(deviations.tail(fit.model.numerator.size()));
  }
  return result;
}

Json flags_json(const FrequencyFitFlags& flags) {
  return {{"unstable", flags.unstable},
          {"break_points_outside_band", flags.break_points_outside_band},
          {"drift", flags.drift},
          {"rank_deficient", flags.rank_deficient},
          {"not_converged", flags.not_converged},
          {"relocated", flags.relocated}};
}

}  // namespace

double relative_rms(const FrfOutcome& outcome) {
  const FrequencyResponse& g = outcome.data.response;
  const Eigen::VectorXcd model = response_at(outcome.fit.model, g.omega_rad_s);
  double sum = 0.0;
  Index count = 0;
  for (Index k = 0; k < model.size(); ++k) {
    if (g.response[k] == 0.0) continue;
    sum += std::norm(model[k] / g.response[k] - 1.0);
    ++count;
  }
  return std::sqrt(sum / static_cast<double>(count));
}

Eigen::MatrixXd known_covariance(const FrequencyFit& fit) {
  const Index counted = (fit.weights.array() > 0.0).count();
  if (2 * counted <= fit.covariance.rows() || !fit.covariance.allFinite()) return {};
  return fit.covariance;
}

void print_frf(std::ostream& stream, const FrfOutcome& outcome) {
  const FrequencyFit& fit = outcome.fit;
  const FrequencyRange band = band_of(outcome.data.response);
  stream << outcome.source << ": " << outcome.data.origin << "; " << outcome.data.response.response.size()
         << " tones fitted, " << number(band.low) << " to " << number(band.high) << " rad/s\n"
         << "basis " << basis_text(fit.model.basis) << (fit.flags.relocated ? " (relocated)" : "") << "\nmethod "
         << blockid::to_text(outcome.options.method) << ", weights " << blockid::to_text(outcome.options.weighting)
         << ", " << fit.iterations << " iterations\n\n"
         << "  relative error, RMS " << number(relative_rms(outcome)) << "; largest " << number(outcome.largest_db, 3)
         << " dB, " << number(outcome.largest_deg, 3) << " degrees\n  condition " << number(fit.condition, 4)
         << ", with columns of unit norm " << number(fit.condition_normalised, 4) << "; rank " << fit.rank << " of "
         << fit.covariance.rows() << "; |A/E| drifts by " << number(fit.drift, 3) << '\n';
  print_summary(stream, outcome.summary);
  if (!outcome.simulation) return;
  const Metrics& metrics = outcome.simulation->total;
  stream << "simulation of the record: RMSE " << number(metrics.rmse) << "  NRMSE " << number(metrics.nrmse) << "  fit "
         << number(metrics.fit_percent) << " %  R2 " << number(metrics.r2) << '\n';
  print_verdict(stream, outcome.tests);
}

Json frf_json(const FrfOutcome& outcome) {
  const FrequencyFit& fit = outcome.fit;
  const FrequencyRange band = band_of(outcome.data.response);
  Json result = {{"format", "blockid-frf"}, {"version", BLOCKID_VERSION}};
  result["method"] = blockid::to_text(outcome.options.method);
  result["weighting"] = blockid::to_text(outcome.options.weighting);
  result["orders"] = {{"nb", fit.model.basis.numerator_degree}, {"na", fit.model.basis.order}};
  if (outcome.model) result["model"] = blockid::to_text(outcome.model->chain);
  result["basis"] = basis_json(fit);
  add_summary(result, outcome.summary);
  result["relative_rms"] = finite_or_null(relative_rms(outcome));
  result["largest_db"] = finite_or_null(outcome.largest_db);
  result["largest_deg"] = finite_or_null(outcome.largest_deg);
  result["cost"] = finite_or_null(fit.cost);
  result["rms"] = finite_or_null(fit.rms);
  result["condition"] = finite_or_null(fit.condition);
  result["condition_normalised"] = finite_or_null(fit.condition_normalised);
  result["rank"] = fit.rank;
  result["parameters"] = fit.covariance.rows();
  result["drift"] = finite_or_null(fit.drift);
  result["iterations"] = fit.iterations;
  result["relocations"] = fit.relocations;
  result["flags"] = flags_json(fit.flags);
  result["data"] = {{"source", outcome.source},
                    {"origin", outcome.data.origin},
                    {"tones", outcome.data.response.response.size()},
                    {"lowest_rad_s", band.low},
                    {"highest_rad_s", band.high}};
  if (outcome.simulation) {
    result["train"] = metrics_json(outcome.simulation->total);
    result["residual_tests"] = tests_json(outcome.tests);
  }
  if (outcome.data.excitation) {
    result["excitation"] = excitation_json(*outcome.data.excitation, fit.covariance.rows());
  }
  result["warnings"] = outcome.warnings;
  return result;
}

}  // namespace blockid::cli
