#include <blockid/init/polynomial_starts.hpp>

#include <blockid/data/error.hpp>
#include <blockid/estimators/detail/complete_windows.hpp>
#include <blockid/estimators/detail/filtered.hpp>
#include <blockid/init/bla.hpp>
#include <blockid/init/detail/lagged_regression.hpp>
#include <blockid/init/root_groups.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace blockid {
namespace {

using detail::filtered;
using Eigen::VectorXd;

constexpr int kPrefilterIterations = 20;
/// A long model has at least this degree, and four times that of the model wanted.
constexpr Index kLeastLongDegree = 20;
/// Samples for each coefficient of a long model.
constexpr Index kSamplesACoefficient = 10;

VectorXd monic(const Eigen::Ref<const VectorXd>& tail) {
  VectorXd result(tail.size() + 1);
  result << 1.0, tail;
  return result;
}

/// Roots outside the circle reflected into it.
VectorXd reflected(const Eigen::Ref<const VectorXd>& tail) {
  return tail.size() == 0 ? VectorXd() : VectorXd(stabilised(monic(tail)).tail(tail.size()));
}

Index long_degree(const PolynomialOrders& orders, const DataSet& data) {
  const Index wanted =
      std::max(kLeastLongDegree, 4 * std::max({orders.na, orders.nb, orders.nc, orders.nd, orders.nf}));
  return std::clamp<Index>(present_count(data) / (2 * kSamplesACoefficient), 1, wanted);
}

/// Signals of one record in deviations from the means, missing outputs bridged.
struct NoiseSeries {
  const Record& record;
  VectorXd v;
};

/// D and C of v = C/D e: an autoregression of degree `length` gives e, least squares on the past of v and e the rest.
/// reach: outputs that one v_t takes, so that missing ones are passed over.
std::pair<VectorXd, VectorXd> noise_model(const std::vector<NoiseSeries>& series, Index nc, Index nd, Index length,
                                          Index reach) {
  const auto regression = [&](Index past, Index degree, Index noise, const std::vector<VectorXd>& e) {
    NormalEquations sums(degree + noise + 1);
    for (std::size_t i = 0; i < series.size(); ++i) {
      const VectorXd& v = series[i].v;
      detail::add_lagged_rows({{v, 1, degree, -1.0}, {noise > 0 ? e[i] : v, 1, noise}}, v, past,
                              detail::complete_windows(series[i].record, past + reach), sums);
    }
    return VectorXd(solve_least_squares(sums.gram()).x);
  };
  std::vector<VectorXd> e;
  Index past = nd;
  if (nc > 0) {
    const VectorXd whitening = monic(regression(length, length, 0, {}));
    for (const NoiseSeries& one : series) e.push_back(filtered(whitening, VectorXd::Ones(1), one.v));
    past = length + std::max(nc, nd);
  }
  const VectorXd theta = regression(past, nd, nc, e);
  return {reflected(theta.head(nd)), reflected(theta.tail(nc))};
}

/// Starts of one data set, in deviations from its means.
class Regressions {
 public:
  Regressions(const DataSet& data, const PolynomialOrders& orders, const PredictionOptions& prediction)
      : orders_(orders), means_(detail::means_of(data, prediction.warmup)), length_(long_degree(orders, data)) {
    data_ = detail::deviations(data, means_);
    prediction_.warmup = prediction.warmup;
  }

  std::vector<PolynomialStart> starts() const {
    if (orders_.na > 0 || orders_.nf == 0) return {of_equation_error()};
    const BlaOrders path{orders_.nb, orders_.nf, orders_.nk};
    std::vector<PolynomialStart> result;
    const Model plain = steiglitz_mcbride(data_, path, prediction_, kPrefilterIterations);
    result.push_back(with_noise(path_of(plain.parameters), "Steiglitz-McBride"));
    if (orders_.nc + orders_.nd > 0) {
      const Model whitened = steiglitz_mcbride(whitened_data(), path, prediction_, kPrefilterIterations);
      result.push_back(with_noise(path_of(whitened.parameters), "Steiglitz-McBride on whitened data"));
    }
    return result;
  }

 private:
  /// A zero model but for [b, f].
  PolynomialModel path_of(const VectorXd& bf) const {
    PolynomialModel model = empty();
    model.theta.segment(orders_.na, orders_.nb + 1) = bf.head(orders_.nb + 1);
    model.theta.tail(orders_.nf) = bf.tail(orders_.nf);
    return model;
  }

  PolynomialModel empty() const {
    return {.orders = orders_,
            .theta = VectorXd::Zero(parameter_count(orders_)),
            .sample_time_s = data_.records.front().sample_time_s,
            .u_mean = means_.u,
            .y_mean = means_.y};
  }

  BlaOrders long_orders() const { return {length_ + orders_.nb, length_, orders_.nk}; }

  DataSet whitened_data() const {
    const VectorXd a = monic(detail::arx_coefficients(data_, long_orders(), prediction_.warmup).tail(length_));
    DataSet result = data_;
    for (Record& record : result.records) {
      record.u = filtered(a, VectorXd::Ones(1), record.u);
      record.y = filtered(a, VectorXd::Ones(1), record.y);
    }
    return result;
  }

  PolynomialStart of_equation_error() const {
    PolynomialModel model = empty();
    if (orders_.nc > 0 && orders_.nd == 0 && orders_.na > 0) {
      model.theta = extended_least_squares();
      return {model, "least squares with the residuals of a long ARX model"};
    }
    const VectorXd ba = detail::arx_coefficients(data_, {orders_.nb, orders_.na, orders_.nk}, prediction_.warmup);
    model.theta.head(orders_.na) = ba.tail(orders_.na);
    model.theta.segment(orders_.na, orders_.nb + 1) = ba.head(orders_.nb + 1);
    return with_noise(std::move(model), "least squares");
  }

  /// [a, b, c] of A y = B u + C e, e from a long ARX model.
  VectorXd extended_least_squares() const {
    const BlaOrders along = long_orders();
    const VectorXd ba = detail::arx_coefficients(data_, along, prediction_.warmup);
    VectorXd b = VectorXd::Zero(along.nk + along.nb + 1);
    b.tail(along.nb + 1) = ba.head(along.nb + 1);
    const VectorXd a = monic(ba.tail(along.na));
    const VectorXd one = VectorXd::Ones(1);
    const auto& [na, nb, nc, nd, nf, nk] = orders_;
    NormalEquations sums(na + nb + 1 + nc + 1);
    const Index first = along.nk + along.nb + std::max({na, nb + nk, nc});
    for (const Record& record : data_.records) {
      const VectorXd e = filtered(a, one, record.y) - filtered(b, one, record.u);
      detail::add_lagged_rows({{record.y, 1, na, -1.0}, {record.u, nk, nb + 1}, {e, 1, nc}}, record.y, first,
                              detail::complete_windows(record, first), sums);
    }
    VectorXd theta = solve_least_squares(sums.gram()).x;
    theta.tail(nc) = reflected(theta.tail(nc));
    return theta;
  }

  /// C and D from v = A y - B/F u.
  PolynomialStart with_noise(PolynomialModel model, const std::string& how) const {
    if (orders_.nc + orders_.nd == 0) return {std::move(model), how};
    const auto [a, b, c, d, f] = polynomials(model);
    std::vector<NoiseSeries> series;
    for (const Record& record : data_.records) {
      series.push_back({record, filtered(a, VectorXd::Ones(1), record.y) - filtered(b, f, record.u)});
    }
    const auto [dt, ct] = noise_model(series, orders_.nc, orders_.nd, length_, orders_.na);
    const Index first = orders_.na + orders_.nb + 1;
    model.theta.segment(first, orders_.nc) = ct;
    model.theta.segment(first + orders_.nc, orders_.nd) = dt;
    return {std::move(model), how + ", then the noise of what is left"};
  }

  PolynomialOrders orders_;
  detail::Means means_;
  Index length_;
  DataSet data_;
  // From rest: what an unknown past adds is small beside what a start is wrong by.
  PredictionOptions prediction_ = {};
};

/// The model with C reflected into the circle.
PolynomialModel with_invertible_noise(PolynomialModel model) {
  const Index first = model.orders.na + model.orders.nb + 1;
  model.theta.segment(first, model.orders.nc) = reflected(model.theta.segment(first, model.orders.nc));
  return model;
}

bool better(const PolynomialFit& one, const PolynomialFit& other) {
  const bool stable = has_stable_predictor(one.model);
  if (stable != has_stable_predictor(other.model)) return stable;
  return one.rmse < other.rmse;
}

}  // namespace

std::vector<PolynomialStart> polynomial_starts(const DataSet& data, const PolynomialOrders& orders,
                                               const PredictionOptions& prediction) {
  check(orders);
  check(data);
  check_excitation(data);
  check_sample_count(data, parameter_count(orders));
  if (orders.na > 0 && orders.nf > 0) {
    fail("polynomial model: expected na = 0 or nf = 0 to start from data alone, got na=", orders.na,
         " and nf=", orders.nf);
  }
  return Regressions(data, orders, prediction).starts();
}

PolynomialIdentification identify_polynomial(const DataSet& data, const PolynomialOrders& orders,
                                             const PolynomialFitOptions& options) {
  PolynomialIdentification best;
  bool cancelled = false;
  const auto attempt = [&](const PolynomialStart& start) {
    PolynomialFit fit = refit(start.model, data, options);
    best.trials.push_back({start.how, fit.initial_rmse, fit.rmse, fit.status, fit.iterations});
    cancelled = fit.status == FitStatus::cancelled;
    PolynomialModel found = fit.model;
    if (best.trials.size() == 1 || better(fit, best.fit)) {
      best.fit = std::move(fit);
      best.how = start.how;
    }
    return found;
  };
  for (const PolynomialStart& start : polynomial_starts(data, orders, options.prediction)) {
    if (cancelled) break;
    const PolynomialModel found = attempt(start);
    if (!cancelled && !has_roots_inside_circle(polynomials(found).c)) {
      attempt({with_invertible_noise(found), start.how + ", roots of C reflected"});
    }
  }
  return best;
}

}  // namespace blockid
