#include <blockid/validation/residual_tests.hpp>

#include <blockid/data/error.hpp>
#include <blockid/data/orthogonal_factor.hpp>
#include <blockid/data/tail_probability.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Share of the instruments' variance below which a direction is the parameters' own: what is left of such a one lives
/// on the first samples of a record, where instruments and sensitivities begin differently.
constexpr double kOwnDirection = 1e-4;

std::string place(std::span<const ResidualRecord> records, std::size_t i) {
  return records.size() == 1 ? "residual tests" : compose("residual tests, record ", i + 1);
}

void check_rows(const std::string& where, const char* what, Index rows, Index expected) {
  if (rows != expected) fail(where, ": expected ", what, " of ", expected, " samples, got ", rows);
}

void check_record(const std::string& where, const ResidualRecord& record, const ResidualRecord& first) {
  const Index n = record.residual.size();
  check_rows(where, "u", record.u.size(), n);
  check_rows(where, "yhat", record.yhat.size(), n);
  if (record.weights.size() > 0) check_rows(where, "weights", record.weights.size(), n);
  for (const auto member : {&ResidualRecord::fitted_here, &ResidualRecord::fitted_elsewhere}) {
    const MatrixXd& sensitivity = record.*member;
    if (sensitivity.cols() > 0) check_rows(where, "sensitivities", sensitivity.rows(), n);
    if (sensitivity.cols() != (first.*member).cols()) {
      fail(where, ": expected sensitivities of ", (first.*member).cols(), " parameters as in the first record, got ",
           sensitivity.cols());
    }
    if (!sensitivity.allFinite()) fail(where, ": expected finite sensitivities");
  }
  if (!record.u.allFinite()) fail(where, ": expected finite inputs");
  if (!record.yhat.allFinite()) fail(where, ": expected finite outputs of the model");
  if (!(record.weights.array() >= 0.0).all() || !record.weights.allFinite()) {
    fail(where, ": expected finite weights of zero or more");
  }
}

/// All records one after another, zero where a sample is not scored.
struct Stacked {
  std::vector<MaskedSignal> residuals;
  std::vector<Index> begins;
  VectorXd mask;
  VectorXd weights;
  VectorXd residual;
  MatrixXd here;
  MatrixXd elsewhere;

  Index rows() const { return mask.size(); }
};

VectorXd weights_of(const ResidualRecord& record) {
  return record.weights.size() > 0 ? record.weights : VectorXd::Ones(record.residual.size());
}

Stacked stacked(std::span<const ResidualRecord> records) {
  Stacked all;
  Index rows = 0;
  for (const ResidualRecord& record : records) {
    all.begins.push_back(rows);
    rows += record.residual.size();
  }
  all.mask.resize(rows);
  all.weights.resize(rows);
  all.residual.resize(rows);
  all.here.resize(rows, records.front().fitted_here.cols());
  all.elsewhere.resize(rows, records.front().fitted_elsewhere.cols());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const ResidualRecord& record = records[i];
    const Index n = record.residual.size();
    const Index begin = all.begins[i];
    const VectorXd weights = weights_of(record);
    const VectorXd mask = (weights.array() > 0.0).cast<double>();
    const VectorXd residual = (mask.array() > 0.0).select(record.residual, 0.0);
    if (!residual.allFinite()) fail(place(records, i), ": expected finite residuals where they are scored");
    all.mask.segment(begin, n) = mask;
    all.weights.segment(begin, n) = weights;
    all.residual.segment(begin, n) = residual;
    all.residuals.push_back({residual, mask});
    if (all.here.cols() > 0) all.here.middleRows(begin, n) = mask.asDiagonal() * record.fitted_here;
    if (all.elsewhere.cols() > 0) all.elsewhere.middleRows(begin, n) = mask.asDiagonal() * record.fitted_elsewhere;
  }
  return all;
}

/// (rows, rank) orthonormal basis of W times the columns, which are scaled first, so that units do not decide on the
/// rank.
MatrixXd weighted_basis(const VectorXd& weights, const MatrixXd& columns) {
  if (columns.cols() == 0) return MatrixXd(columns.rows(), 0);
  MatrixXd scaled = weights.asDiagonal() * columns;
  for (Index k = 0; k < scaled.cols(); ++k) {
    const double norm = scaled.col(k).norm();
    if (norm > 0.0) scaled.col(k) /= norm;
  }
  // The derivatives are exact to rounding; 1e-9 leaves room for its growth in long recursions.
  constexpr double kRank = 1e-9;
  Eigen::ColPivHouseholderQR<MatrixXd> qr(scaled.rows(), scaled.cols());
  qr.setThreshold(kRank);
  qr.compute(scaled);
  return q_times(qr.householderQ(), MatrixXd::Identity(scaled.rows(), qr.rank()));
}

/// `basis` with one direction more, unless it holds that already.
MatrixXd with_direction(const MatrixXd& basis, const VectorXd& direction) {
  VectorXd rest = direction.normalized();
  // Twice is enough for orthogonality to rounding.
  for (int pass = 0; pass < 2; ++pass) rest -= basis * (basis.transpose() * rest);
  constexpr double kInside = 1e-7;
  if (rest.norm() < kInside) return basis;
  MatrixXd result(basis.rows(), basis.cols() + 1);
  result << basis, rest.normalized();
  return result;
}

/// A signal of each record and the lags at which it is laid beside the residual.
struct Instruments {
  std::function<VectorXd(const ResidualRecord&)> signal;
  Index first_lag;
  Index last_lag;
};

/// (rows, lags) z_{t - lag} where the residual is scored, the mean of each column removed; 0 before the record begins.
MatrixXd instrument_matrix(std::span<const ResidualRecord> records, const Stacked& all, const Instruments& kind) {
  const Index lags = kind.last_lag - kind.first_lag + 1;
  std::vector<MaskedSignal> signals;
  for (const ResidualRecord& record : records) {
    signals.push_back({kind.signal(record), VectorXd::Ones(record.residual.size())});
  }
  const std::vector<VectorXd> centred = deviations(signals);
  MatrixXd z = MatrixXd::Zero(all.rows(), lags);
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Index n = centred[i].size();
    for (Index k = 0; k < lags; ++k) {
      const Index lag = kind.first_lag + k;
      const Index count = n - std::abs(lag);
      if (count <= 0) continue;
      z.col(k).segment(all.begins[i] + std::max<Index>(lag, 0), count) =
          centred[i].segment(std::max<Index>(-lag, 0), count);
    }
  }
  z = all.mask.asDiagonal() * z;
  const Eigen::RowVectorXd means = z.colwise().sum() / all.mask.sum();
  return z - all.mask * means;
}

/// What all tests share.
struct Setting {
  std::span<const ResidualRecord> records;
  const ResidualTestOptions& options;
  Stacked all;
  /// Of what was fitted here.
  MatrixXd q;
  /// The same and the mean, which is not to disturb any test but that of the offset.
  MatrixXd q_and_mean;
  Autoregression noise;
};

/// Zt = Z - W Q Q' W^-1 Z
MatrixXd projected(const Setting& setting, const MatrixXd& q, const MatrixXd& z) {
  if (q.cols() == 0) return z;
  const VectorXd& w = setting.all.weights;
  const VectorXd inverse = (w.array() > 0.0).select(w.cwiseInverse(), 0.0);
  const MatrixXd inner = q.transpose() * (inverse.asDiagonal() * z);
  return z - w.asDiagonal() * (q * inner);
}

/// (W^-1 Q) and (W Q) of the rows of one record, W^-1 being 0 where W is: Pi = left right'.
struct ProjectionFactors {
  MatrixXd left;
  MatrixXd right;
};

ProjectionFactors projection_factors(const Setting& setting, std::size_t i) {
  const Index n = setting.records[i].residual.size();
  const auto q = setting.q_and_mean.middleRows(setting.all.begins[i], n);
  const auto w = setting.all.weights.segment(setting.all.begins[i], n);
  const VectorXd inverse = (w.array() > 0.0).select(w.cwiseInverse(), 0.0);
  return {inverse.asDiagonal() * q, w.asDiagonal() * q};
}

/// (K + 1,) what the projection adds to the expected sums of products: r = (I - Pi) v, so that with G = R right and
/// H = right' R right it is -sum left_t . G_{t+k} - sum G_t . left_{t+k} + sum left_t' H left_{t+k}.
VectorXd projection_bias(const Setting& setting, const Autoregression& noise, Index lags) {
  std::vector<ProjectionFactors> factors;
  std::vector<MatrixXd> g;
  const Index rank = setting.q_and_mean.cols();
  MatrixXd h = MatrixXd::Zero(rank, rank);
  for (std::size_t i = 0; i < setting.records.size(); ++i) {
    factors.push_back(projection_factors(setting, i));
    g.push_back(covariance_times(noise, factors[i].right));
    h += factors[i].right.transpose() * g[i];
  }
  VectorXd bias = VectorXd::Zero(lags + 1);
  for (std::size_t i = 0; i < setting.records.size(); ++i) {
    const MatrixXd& left = factors[i].left;
    const MatrixXd of_h = left * h;
    const Index n = left.rows();
    for (Index k = 0; k <= std::min(lags, n - 1); ++k) {
      bias[k] -= left.topRows(n - k).cwiseProduct(g[i].bottomRows(n - k)).sum();
      bias[k] -= left.bottomRows(n - k).cwiseProduct(g[i].topRows(n - k)).sum();
      bias[k] += of_h.topRows(n - k).cwiseProduct(left.bottomRows(n - k)).sum();
    }
  }
  return bias;
}

/// The noise from the residual, with what the projection took out of it put back: a few rounds, since the correction
/// is a small share of the whole and itself depends on the noise.
Autoregression noise_of(const Setting& setting) {
  const PairSums sums = pair_sums(setting.all.residuals, setting.options.noise_order);
  Autoregression noise = fit_autoregression(sums);
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds && noise.variance > 0.0; ++round) {
    PairSums corrected = sums;
    corrected.products -= projection_bias(setting, noise, setting.options.noise_order);
    noise = fit_autoregression(corrected);
  }
  return noise;
}

/// Z' R Z, record by record.
MatrixXd noise_part(const Setting& setting, const MatrixXd& z) {
  MatrixXd sum = MatrixXd::Zero(z.cols(), z.cols());
  for (std::size_t i = 0; i < setting.records.size(); ++i) {
    const Index n = setting.records[i].residual.size();
    const MatrixXd f = backward_filtered(setting.noise, z.middleRows(setting.all.begins[i], n));
    sum.selfadjointView<Eigen::Lower>().rankUpdate(f.transpose());
  }
  return setting.noise.innovation_variance * MatrixXd(sum.selfadjointView<Eigen::Lower>());
}

/// Quadratic form c' V^+ c with its rank.
struct QuadraticForm {
  double value = 0.0;
  Index rank = 0;
};

/// scale: variances before the projection.
QuadraticForm quadratic_form(const VectorXd& c, const MatrixXd& v, const VectorXd& scale) {
  VectorXd inverse = VectorXd::Zero(c.size());
  for (Index k = 0; k < c.size(); ++k) {
    if (scale[k] > 0.0) inverse[k] = 1.0 / std::sqrt(scale[k]);
  }
  const MatrixXd scaled = inverse.asDiagonal() * v * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
  const VectorXd parts = eigen.eigenvectors().transpose() * (inverse.asDiagonal() * c);
  QuadraticForm form;
  for (Index k = 0; k < parts.size(); ++k) {
    if (!(eigen.eigenvalues()[k] > kOwnDirection)) continue;
    form.value += parts[k] * parts[k] / eigen.eigenvalues()[k];
    ++form.rank;
  }
  return form;
}

/// The lag-by-lag picture of c and its standard deviations.
void fill_correlations(ResidualTest& test, const Setting& setting, const MatrixXd& z, const VectorXd& c,
                       const VectorXd& variances) {
  const double residual_norm = setting.all.residual.norm();
  const double point = two_sided_point(setting.options.significance);
  test.correlations = VectorXd::Zero(c.size());
  test.bands = VectorXd::Zero(c.size());
  for (Index k = 0; k < c.size(); ++k) {
    const double norm = z.col(k).norm() * residual_norm;
    if (!(norm > 0.0)) continue;
    test.correlations[k] = c[k] / norm;
    test.bands[k] = point * std::sqrt(std::max(variances[k], 0.0)) / norm;
  }
}

/// The test of c = Zt'r; without degrees of freedom when the parameters own all directions.
ResidualTest instrument_test(const Setting& setting, ResidualTestKind kind, const MatrixXd& z, Index first_lag) {
  const MatrixXd zt = projected(setting, kind == ResidualTestKind::offset ? setting.q : setting.q_and_mean, z);
  const VectorXd c = zt.transpose() * setting.all.residual;
  MatrixXd v = noise_part(setting, zt);
  VectorXd scale = noise_part(setting, z).diagonal();
  if (setting.all.elsewhere.cols() > 0) {
    const MatrixXd d = zt.transpose() * setting.all.elsewhere;
    const MatrixXd added = d * setting.options.covariance * d.transpose();
    v += added;
    scale += added.diagonal();
  }
  ResidualTest test;
  test.kind = kind;
  const QuadraticForm form = quadratic_form(c, v, scale);
  test.statistic = form.value;
  test.degrees_of_freedom = form.rank;
  if (form.rank > 0) test.p_value = chi_square_tail(form.value, static_cast<double>(form.rank));
  test.passed = test.p_value >= setting.options.significance;
  test.lags =
      VectorXd::LinSpaced(z.cols(), static_cast<double>(first_lag), static_cast<double>(first_lag + z.cols() - 1));
  fill_correlations(test, setting, z, c, v.diagonal());
  return test;
}

ResidualTest offset_test(const Setting& setting) {
  return instrument_test(setting, ResidualTestKind::offset, setting.all.mask, 0);
}

/// The noise as it is when it is white.
Autoregression white_noise(double variance) {
  return {
      .coefficients = {}, .autocorrelation = VectorXd::Ones(1), .innovation_variance = variance, .variance = variance};
}

ResidualTest whiteness_test(const Setting& setting) {
  const Index lags = setting.options.lags;
  const PairSums sums = pair_sums(setting.all.residuals, lags);
  const double n = sums.counts[0];
  const double variance = sums.products[0] / (n - static_cast<double>(setting.q_and_mean.cols()));
  const VectorXd products = sums.products - projection_bias(setting, white_noise(variance), lags);
  ResidualTest test;
  test.kind = ResidualTestKind::whiteness;
  test.lags = VectorXd::LinSpaced(lags, 1.0, static_cast<double>(lags));
  test.correlations = products.tail(lags) / products[0];
  test.bands = VectorXd::Zero(lags);
  const double point = two_sided_point(setting.options.significance);
  for (Index k = 1; k <= lags; ++k) {
    if (!(sums.counts[k] > 0.0)) continue;
    const double of_lag = sums.counts[k] / (n * (n + 2.0));
    test.bands[k - 1] = point * std::sqrt(of_lag);
    test.statistic += test.correlations[k - 1] * test.correlations[k - 1] / of_lag;
    ++test.degrees_of_freedom;
  }
  test.p_value = chi_square_tail(test.statistic, static_cast<double>(test.degrees_of_freedom));
  test.passed = test.p_value >= setting.options.significance;
  return test;
}

VectorXd centred(const VectorXd& x) { return x.array() - x.mean(); }

std::vector<std::pair<ResidualTestKind, Instruments>> instruments(Index lags) {
  using Kind = ResidualTestKind;
  const auto input = [](const ResidualRecord& r) { return r.u; };
  const auto squared = [](const ResidualRecord& r) { return VectorXd(centred(r.u).array().square()); };
  const auto absolute = [](const ResidualRecord& r) { return VectorXd(centred(r.u).array().abs()); };
  const auto output_squared = [](const ResidualRecord& r) { return VectorXd(centred(r.yhat).array().square()); };
  const auto output_cubed = [](const ResidualRecord& r) { return VectorXd(centred(r.yhat).array().cube()); };
  return {{Kind::input, {input, 0, lags}},
          {Kind::later_input, {input, -lags, -1}},
          {Kind::squared_input, {squared, 0, lags}},
          {Kind::absolute_input, {absolute, 0, lags}},
          {Kind::squared_output, {output_squared, 0, lags}},
          {Kind::cubed_output, {output_cubed, 0, lags}}};
}

void check_options(const Stacked& all, const ResidualTestOptions& options) {
  if (options.lags < 1) fail("residual tests: expected at least 1 lag, got ", options.lags);
  if (!(options.significance > 0.0 && options.significance < 1.0)) {
    fail("residual tests: expected a significance in (0, 1), got ", options.significance);
  }
  if (options.noise_order < 0) fail("residual tests: expected a noise order of 0 or more, got ", options.noise_order);
  const Index parameters = all.elsewhere.cols();
  if (parameters > 0 && (options.covariance.rows() != parameters || options.covariance.cols() != parameters)) {
    fail("residual tests: expected a covariance of ", parameters, " x ", parameters, ", got ",
         options.covariance.rows(), " x ", options.covariance.cols());
  }
  const double scored = all.mask.sum();
  const double least = 4.0 * static_cast<double>(options.lags + 1) + static_cast<double>(all.here.cols());
  if (scored < least) {
    fail("residual tests: expected at least ", least, " scored samples for ", options.lags, " lags and ",
         all.here.cols(), " fitted unknowns, got ", scored);
  }
}

/// |Q'W r| / sqrt(rank) in units of the weighted residual's deviation.
double distance_from_minimum(const Setting& setting) {
  const Index rank = setting.q.cols();
  if (rank == 0) return 0.0;
  const VectorXd weighted = setting.all.weights.cwiseProduct(setting.all.residual);
  const double inside = (setting.q.transpose() * weighted).squaredNorm();
  const double outside = std::max(weighted.squaredNorm() - inside, 0.0);
  const double variance = outside / (setting.all.mask.sum() - static_cast<double>(rank));
  return std::sqrt(inside / (static_cast<double>(rank) * variance));
}

}  // namespace

std::string to_text(ResidualTestKind kind) {
  switch (kind) {
    case ResidualTestKind::offset:
      return "offset";
    case ResidualTestKind::whiteness:
      return "whiteness";
    case ResidualTestKind::input:
      return "input";
    case ResidualTestKind::later_input:
      return "later input";
    case ResidualTestKind::squared_input:
      return "squared input";
    case ResidualTestKind::absolute_input:
      return "absolute input";
    case ResidualTestKind::squared_output:
      return "squared output";
    case ResidualTestKind::cubed_output:
      return "cubed output";
  }
  return "unknown";
}

const ResidualTest* ResidualTests::find(ResidualTestKind kind) const {
  const auto found = std::find_if(tests.begin(), tests.end(), [&](const ResidualTest& t) { return t.kind == kind; });
  return found == tests.end() ? nullptr : &*found;
}

bool ResidualTests::model_passed() const {
  return std::all_of(tests.begin(), tests.end(),
                     [](const ResidualTest& t) { return t.passed || t.kind == ResidualTestKind::whiteness; });
}

ResidualTests residual_tests(std::span<const ResidualRecord> records, const ResidualTestOptions& options) {
  if (records.empty()) fail("residual tests: expected at least one record");
  for (std::size_t i = 0; i < records.size(); ++i) check_record(place(records, i), records[i], records.front());
  Setting setting{records, options, stacked(records), {}, {}, {}};
  const Stacked& all = setting.all;
  check_options(all, options);
  setting.q = weighted_basis(all.weights, all.here);
  setting.q_and_mean = with_direction(setting.q, all.weights);
  setting.noise = noise_of(setting);
  const double largest = all.residual.cwiseAbs().maxCoeff();
  if (!(std::sqrt(setting.noise.variance) > 1e-14 * largest)) {
    fail("residual tests: the residual does not vary, so there is nothing to test");
  }

  ResidualTests result;
  result.significance = options.significance;
  result.samples = static_cast<Index>(all.mask.sum());
  result.rank = setting.q.cols();
  result.deviation = std::sqrt(all.residual.squaredNorm() / static_cast<double>(result.samples - result.rank));
  result.distance_from_minimum = distance_from_minimum(setting);
  result.noise = setting.noise;

  const auto keep = [&](ResidualTest test) {
    if (test.degrees_of_freedom > 0) result.tests.push_back(std::move(test));
  };
  keep(offset_test(setting));
  keep(whiteness_test(setting));
  for (const auto& [kind, instrument] : instruments(options.lags)) {
    keep(instrument_test(setting, kind, instrument_matrix(records, all, instrument), instrument.first_lag));
  }
  return result;
}

std::string explanation(const ResidualTest& test) {
  if (test.passed) return {};
  switch (test.kind) {
    case ResidualTestKind::offset:
      return "the residual has a mean: an offset is missing, or the signals should be detrended";
    case ResidualTestKind::whiteness:
      return "the residual is coloured: no fault of an output-error model, but standard deviations for white residuals "
             "do not hold (take robust ones)";
    case ResidualTestKind::input:
      return "the residual follows the input linearly: orders of a filter are too low, a delay is wrong, or the search "
             "ended in a poor minimum";
    case ResidualTestKind::later_input:
      return "the input follows the residual: the record was taken under feedback, the delay of the model is too long, "
             "or the channels are shifted";
    case ResidualTestKind::squared_input:
    case ResidualTestKind::absolute_input:
      return "the residual follows the magnitude of the input: an even nonlinearity is missing or too coarse";
    case ResidualTestKind::squared_output:
      return "the residual follows the magnitude of the output: an even nonlinearity behind the dynamics is missing or "
             "too coarse";
    case ResidualTestKind::cubed_output:
      return "the residual follows the cube of the output: an odd nonlinearity, such as a saturation, is missing or "
             "too coarse";
  }
  return {};
}

}  // namespace blockid
