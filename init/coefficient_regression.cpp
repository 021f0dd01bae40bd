#include <blockid/blocks/block.hpp>
#include <blockid/data/error.hpp>
#include <blockid/data/record.hpp>
#include <blockid/estimators/accumulators.hpp>
#include <blockid/init/coefficient_regression.hpp>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace blockid {
namespace {

/// Delays of the inputs in a product, ascending; empty for the constant.
using Product = std::vector<Index>;

/// All products of up to `degree` of u_t .. u_{t-n}; each stands behind the product that it extends by one input.
struct Products {
  std::vector<Product> list;
  /// The product without its last input.
  std::vector<std::size_t> shorter;
  std::map<Product, Index> place;

  Products(Index n, Index degree) {
    add({}, 0);
    for (std::size_t k = 0; k < list.size(); ++k) {
      if (std::ssize(list[k]) == degree) break;
      const Product product = list[k];
      for (Index delay = product.empty() ? 0 : product.back(); delay <= n; ++delay) {
        Product longer = product;
        longer.push_back(delay);
        add(std::move(longer), k);
      }
    }
  }

  Index size() const { return std::ssize(list); }

 private:
  void add(Product product, std::size_t from) {
    place.emplace(product, std::ssize(list));
    list.push_back(std::move(product));
    shorter.push_back(from);
  }
};

/// min(binomial(n + 1 + degree, degree), kMaxRegressors + 1).
Index product_count(Index n, Index degree) {
  double count = 1.0;
  for (Index d = 1; d <= degree && count <= kMaxRegressors; ++d) {
    count *= static_cast<double>(n + 1 + d) / static_cast<double>(d);
  }
  return static_cast<Index>(std::lround(std::min(count, static_cast<double>(kMaxRegressors + 1))));
}

/// In how many orders the inputs of a product can be written.
double orders(const Product& product) {
  double count = 1.0;
  double run = 0.0;
  for (std::size_t k = 0; k < product.size(); ++k) {
    run = k > 0 && product[k] == product[k - 1] ? run + 1.0 : 1.0;
    count *= static_cast<double>(k + 1) / run;
  }
  return count;
}

double factorial(std::size_t n) { return n == 0 ? 1.0 : static_cast<double>(n) * factorial(n - 1); }

double input_deviation(const DataSet& data) {
  double sum = 0.0;
  double count = 0.0;
  for (const Record& record : data.records) {
    sum += record.u.squaredNorm();
    count += static_cast<double>(record.u.size());
  }
  if (!(sum > 0.0)) fail("coefficient regression: the input is zero");
  return std::sqrt(sum / count);
}

void add_rows(const Record& record, const Products& products, Index n, double scale, NormalEquations& sums) {
  const Index stride = padded_columns(sums.columns());
  std::vector<double> tile(static_cast<std::size_t>(kMaxTileRows * stride), 0.0);
  Index rows = 0;
  for (Index t = n; t < record.u.size(); ++t) {
    if (is_missing(record, t)) continue;
    double* row = tile.data() + rows * stride;
    const double w = weight(record, t);
    row[0] = w;
    for (std::size_t k = 1; k < products.list.size(); ++k) {
      row[k] = row[products.shorter[k]] * scale * record.u[t - products.list[k].back()];
    }
    row[products.size()] = w * record.y[t];
    if (++rows == kMaxTileRows) {
      sums.add(tile.data(), rows, stride);
      rows = 0;
    }
  }
  sums.add(tile.data(), rows, stride);
}

/// Rows: products of d - 1 inputs, u_t among them, d = 2 .. degree; columns: one more input. Entries theta_d A_k ...
Eigen::MatrixXd products_with_present(const Products& products, const Eigen::VectorXd& g, Index n, Index degree) {
  std::vector<Product> heads;
  for (const Product& product : products.list) {
    if (!product.empty() && std::ssize(product) < degree && product.front() == 0) heads.push_back(product);
  }
  Eigen::MatrixXd matrix(std::ssize(heads), n + 1);
  for (Index r = 0; r < matrix.rows(); ++r) {
    for (Index delay = 0; delay <= n; ++delay) {
      Product product = heads[static_cast<std::size_t>(r)];
      product.insert(std::upper_bound(product.begin(), product.end(), delay), delay);
      matrix(r, delay) = g[products.place.at(product)] / orders(product);
    }
  }
  return matrix;
}

/// theta_d B_0 .. theta_d B_n from the coefficients of degree d, weighted as if the input were white and Gaussian.
Eigen::VectorXd filtered_terms(const Products& products, const Eigen::VectorXd& g, const Eigen::VectorXd& a, Index d) {
  std::vector<Index> rows;
  for (Index k = 0; k < products.size(); ++k) {
    if (std::ssize(products.list[static_cast<std::size_t>(k)]) == d) rows.push_back(k);
  }
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(std::ssize(rows), a.size());
  Eigen::VectorXd target(matrix.rows());
  for (Index r = 0; r < matrix.rows(); ++r) {
    const Product& product = products.list[static_cast<std::size_t>(rows[static_cast<std::size_t>(r)])];
    const double count = orders(product);
    const double w = std::sqrt(factorial(product.size()) / count);
    target[r] = w * g[rows[static_cast<std::size_t>(r)]];
    for (Index h = 0; h <= product.front(); ++h) {
      double value = w * count;
      for (const Index delay : product) value *= a[delay - h];
      matrix(r, h) = value;
    }
  }
  return matrix.colPivHouseholderQr().solve(target);
}

/// left right' nearest to a matrix, right or left scaled to begin with 1 by the caller.
struct RankOne {
  Eigen::VectorXd left;
  Eigen::VectorXd right;
  double ratio;
};

RankOne rank_one(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Eigen::VectorXd& sigma = svd.singularValues();
  const double ratio = sigma.size() > 1 && sigma[0] > 0.0 ? sigma[1] / sigma[0] : 0.0;
  return {sigma[0] * svd.matrixU().col(0), svd.matrixV().col(0), ratio};
}

/// Relative size below which a leading coefficient counts as zero.
constexpr double kNoLeading = 1e-9;

Eigen::VectorXd with_leading_one(const Eigen::VectorXd& v, const char* which) {
  if (!(std::abs(v[0]) > kNoLeading * v.norm())) {
    fail("coefficient regression: ", which, " has no leading coefficient; the system has a delay, or its output shows ",
         "no product of two or more inputs");
  }
  return v / v[0];
}

}  // namespace

CoefficientRegression coefficient_regression(const DataSet& data, Index n, Index degree) {
  check(data);
  if (n < 0 || degree < 2) fail("coefficient regression: expected n >= 0 and degree >= 2, got ", n, " and ", degree);
  if (product_count(n, degree) > kMaxRegressors) {
    fail("coefficient regression: n=", n, " and degree ", degree, " need more than ", kMaxRegressors, " regressors");
  }
  const Products products(n, degree);
  const double deviation = input_deviation(data);
  NormalEquations sums(products.size() + 1);
  for (const Record& record : data.records) add_rows(record, products, n, 1.0 / deviation, sums);
  if (sums.rows() < products.size()) {
    fail("coefficient regression: ", products.size(), " regressors need as many samples, got ", sums.rows());
  }
  const LinearSolution solution = solve_least_squares(sums.gram());

  CoefficientRegression result;
  result.regressors = products.size();
  result.rank = solution.rank;
  result.rmse = std::sqrt(solution.residual_sum_of_squares / static_cast<double>(sums.rows()));
  const RankOne first = rank_one(products_with_present(products, solution.x, n, degree));
  result.first = with_leading_one(first.right, "the first filter");
  result.first_ratio = first.ratio;
  Eigen::MatrixXd terms(n + 1, degree);
  for (Index d = 1; d <= degree; ++d) terms.col(d - 1) = filtered_terms(products, solution.x, result.first, d);
  const RankOne second = rank_one(terms);
  result.second = with_leading_one(second.left, "the second filter");
  result.second_ratio = second.ratio;
  result.polynomial = second.left[0] * second.right;
  for (Index d = 1; d <= degree; ++d) result.polynomial[d - 1] /= std::pow(deviation, static_cast<double>(d));
  return result;
}

}  // namespace blockid
