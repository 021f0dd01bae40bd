#include <blockid/estimators/accumulators.hpp>

#include "data/message.hpp"
#include "support/signals.hpp"

#include <blockid/blocks/block.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

namespace blockid {
namespace {

using ::testing::HasSubstr;
using testing::Noise;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Two orders of summation of some thousand products: rounding grows like sqrt(n) 1e-16, with two digits of room.
constexpr double kSum = 1e-13;
// Least squares from J'J: the condition number of the scaled columns squared (below 1e2 here) times rounding.
constexpr double kSolve = 1e-11;

// Rows of a padded tile; what lies beyond the columns must not count.
class Tile {
 public:
  explicit Tile(const Eigen::MatrixXd& rows) : rows_(rows.rows()), stride_(padded_columns(rows.cols())) {
    data_.assign(static_cast<std::size_t>(std::max<Index>(rows_, 1) * stride_), 7e3);
    for (Index t = 0; t < rows.rows(); ++t) {
      for (Index c = 0; c < rows.cols(); ++c) data_[static_cast<std::size_t>(t * stride_ + c)] = rows(t, c);
    }
  }
  template <class Sums>
  void add_to(Sums& sums) const {
    sums.add(data_.data(), rows_, stride_);
  }

 private:
  Index rows_;
  Index stride_;
  std::vector<double> data_;
};

template <class Sums>
void add_in_tiles(const Eigen::MatrixXd& rows, Index tile, Sums& sums) {
  for (Index first = 0; first < rows.rows(); first += tile) {
    Tile(rows.middleRows(first, std::min(tile, rows.rows() - first))).add_to(sums);
  }
}

// Largest difference of two Gram matrices relative to the norms of the columns.
double distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd scale = b.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  return (scale.asDiagonal() * (a - b) * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

// Columns whose units differ by ten orders of magnitude.
Eigen::MatrixXd ill_scaled(Index rows, Index columns, std::uint64_t seed) {
  Eigen::MatrixXd m = Noise(seed).matrix(rows, columns);
  for (Index c = 0; c < columns; ++c)
    m.col(c) *= std::pow(10.0, 10.0 * static_cast<double>(c) / static_cast<double>(columns) - 5.0);
  return m;
}

struct Shape {
  Index rows;
  Index columns;
  Index tile;
};

class AccumulatorShapes : public ::testing::TestWithParam<Shape> {};

TEST_P(AccumulatorShapes, NormalEquationsAreTheDenseProduct) {
  const Eigen::MatrixXd rows = ill_scaled(GetParam().rows, GetParam().columns, 3);
  NormalEquations sums(rows.cols());
  add_in_tiles(rows, GetParam().tile, sums);
  EXPECT_EQ(sums.rows(), rows.rows());
  EXPECT_EQ(sums.columns(), rows.cols());
  EXPECT_LT(distance(sums.gram(), rows.transpose() * rows), kSum);
  EXPECT_EQ(sums.gram(), sums.gram().transpose());
}

TEST_P(AccumulatorShapes, TriangleIsAFactorOfTheSameMatrix) {
  const Eigen::MatrixXd rows = ill_scaled(GetParam().rows, GetParam().columns, 4);
  QrTriangle sums(rows.cols());
  add_in_tiles(rows, GetParam().tile, sums);
  EXPECT_EQ(sums.rows(), rows.rows());
  const Eigen::MatrixXd& r = sums.triangle();
  EXPECT_TRUE(r.isUpperTriangular(0.0));
  EXPECT_LT(distance(r.transpose() * r, rows.transpose() * rows), kSum);
}

INSTANTIATE_TEST_SUITE_P(All, AccumulatorShapes,
                         ::testing::Values(Shape{1, 1, 1}, Shape{5, 3, 2}, Shape{100, 7, 1}, Shape{100, 8, 33},
                                           Shape{513, 9, 512}, Shape{1000, 21, 64}, Shape{700, 40, 512}));

TEST(NormalEquationsTest, HalvesAddUpToTheWhole) {
  const Eigen::MatrixXd rows = ill_scaled(300, 6, 5);
  NormalEquations first(6);
  NormalEquations second(6);
  add_in_tiles(rows.topRows(130), 40, first);
  add_in_tiles(rows.bottomRows(170), 64, second);
  NormalEquations third = first;
  first.add(second);
  third.add(second.gram(), second.rows());
  EXPECT_EQ(first.rows(), 300);
  EXPECT_EQ(third.rows(), 300);
  EXPECT_LT(distance(first.gram(), rows.transpose() * rows), kSum);
  EXPECT_EQ(third.gram(), first.gram());
}

TEST(NormalEquationsTest, MistakesAreNamed) {
  NormalEquations sums(3);
  EXPECT_THAT(BLOCKID_MESSAGE(sums.add(NormalEquations(4))), ::testing::AllOf(HasSubstr("4"), HasSubstr("3")));
  EXPECT_THAT(BLOCKID_MESSAGE(sums.add(Eigen::MatrixXd::Zero(2, 3), 1)), HasSubstr("2 x 3"));
  EXPECT_THAT(BLOCKID_MESSAGE(NormalEquations(0)), HasSubstr("got 0"));
  EXPECT_THAT(BLOCKID_MESSAGE(QrTriangle(0)), HasSubstr("got 0"));
}

TEST(QrTriangleTest, KeepsWhatSquaringWouldLose) {
  // Two columns that differ by 1e-10: J'J sees one direction only (1e-20 of the other), the triangle sees both.
  Eigen::MatrixXd rows = Noise(6).matrix(200, 3);
  const Eigen::VectorXd difference = rows.col(1);
  rows.col(1) = rows.col(0) + 1e-10 * difference;
  QrTriangle sums(3);
  add_in_tiles(rows, 50, sums);
  const Eigen::VectorXd expected = rows.leftCols(2).jacobiSvd().singularValues();
  const Eigen::VectorXd found = sums.triangle().topLeftCorner(2, 2).jacobiSvd().singularValues();
  // The small singular value is 1e-10 of the large one, of which rounding leaves six digits.
  EXPECT_NEAR(found[1] / expected[1], 1.0, 1e-5);
  EXPECT_EQ(scaled_pseudo_inverse((rows.transpose() * rows).topLeftCorner(2, 2)).rank, 1);
}

TEST(QrTriangleTest, LeastSquaresKeepTheDigitsToo) {
  Eigen::MatrixXd rows = Noise(6).matrix(200, 3);
  const Eigen::VectorXd difference = rows.col(1);
  rows.col(1) = rows.col(0) + 1e-6 * difference;
  rows.leftCols(1) *= 1e8;
  QrTriangle sums(3);
  add_in_tiles(rows, 50, sums);
  const LinearSolution solution = solve_least_squares(sums);
  const Eigen::VectorXd expected = rows.leftCols(2).colPivHouseholderQr().solve(rows.col(2));
  EXPECT_EQ(solution.rank, 2);
  // Condition 1e6 of the scaled columns times rounding, in units of a column's own scale.
  EXPECT_NEAR(solution.x[0] * 1e8, expected[0] * 1e8, 1e-8 * std::abs(expected[0] * 1e8));
  EXPECT_NEAR(solution.x[1], expected[1], 1e-8 * std::abs(expected[1]));
  const double left = (rows.col(2) - rows.leftCols(2) * expected).squaredNorm();
  EXPECT_NEAR(solution.residual_sum_of_squares, left, 1e-10 * left);
  const PseudoInverse inverse = scaled_pseudo_inverse(sums);
  // Oracle: (J'J)^-1 = W W' with W = J^+, by the dense pseudo-inverse of the scaled rows.
  const Eigen::Vector2d scale = rows.leftCols(2).colwise().norm();
  const Eigen::MatrixXd scaled = rows.leftCols(2) * scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd w = scaled.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::MatrixXd found = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();
  EXPECT_LT((found - w * w.transpose()).norm(), 1e-8 * found.norm());
  EXPECT_NEAR(solution.condition, inverse.condition, 1e-9 * inverse.condition);
}

TEST(QrTriangleTest, LeavesOutWhatTheRowsDoNotDetermine) {
  Eigen::MatrixXd rows = Noise(9).matrix(100, 4);
  rows.col(1) = -3.0 * rows.col(0);
  QrTriangle sums(4);
  add_in_tiles(rows, 32, sums);
  const LinearSolution solution = solve_least_squares(sums);
  EXPECT_EQ(solution.rank, 2);
  EXPECT_TRUE(std::isinf(solution.condition));
  const Eigen::VectorXd kept = rows.col(0);
  Eigen::MatrixXd independent(100, 2);
  independent << kept, rows.col(2);
  const Eigen::VectorXd best = independent.colPivHouseholderQr().solve(rows.col(3));
  const double left = (rows.col(3) - independent * best).squaredNorm();
  EXPECT_NEAR(solution.residual_sum_of_squares, left, 1e-10 * left);
  const PseudoInverse inverse = scaled_pseudo_inverse(sums);
  ASSERT_EQ(inverse.null_space.cols(), 1);
  EXPECT_LT((rows.leftCols(3) * inverse.null_space).norm(), 1e-12);
}

Eigen::MatrixXd gram_of(const Eigen::MatrixXd& j, const Eigen::VectorXd& r) {
  Eigen::MatrixXd rows(j.rows(), j.cols() + 1);
  rows << j, r;
  return rows.transpose() * rows;
}

TEST(SolveLeastSquaresTest, FullRankIsTheQrSolution) {
  const Eigen::MatrixXd j = ill_scaled(400, 6, 7);
  const Eigen::VectorXd r = Noise(8).white(400);
  const LinearSolution solution = solve_least_squares(gram_of(j, r));
  const Eigen::VectorXd expected = j.colPivHouseholderQr().solve(r);
  const Eigen::VectorXd norms = j.colwise().norm();
  EXPECT_LT((norms.asDiagonal() * (solution.x - expected)).norm(), kSolve * r.norm());
  EXPECT_NEAR(solution.residual_sum_of_squares, (r - j * expected).squaredNorm(), kSolve * r.squaredNorm());
  EXPECT_EQ(solution.rank, 6);
  const Eigen::VectorXd values = (j * norms.cwiseInverse().asDiagonal()).jacobiSvd().singularValues();
  EXPECT_NEAR(solution.condition, values[0] / values[5], 1e-9 * solution.condition);
}

TEST(SolveLeastSquaresTest, RankDeficientIsOfMinimalNormInTheScaledColumns) {
  // Rounding makes the eigenvalue that should be zero positive in some draws and negative in others.
  for (std::uint64_t seed = 9; seed < 29; ++seed) {
    Eigen::MatrixXd j = ill_scaled(300, 5, seed);
    j.col(4) = 1e3 * j.col(0) - 2.0 * j.col(2);
    const Eigen::VectorXd r = Noise(100 + seed).white(300);
    const LinearSolution solution = solve_least_squares(gram_of(j, r));
    EXPECT_EQ(solution.rank, 4);
    EXPECT_TRUE(std::isinf(solution.condition));
    const Eigen::VectorXd norms = j.colwise().norm();
    const Eigen::MatrixXd scaled = j * norms.cwiseInverse().asDiagonal();
    const Eigen::VectorXd expected = scaled.completeOrthogonalDecomposition().solve(r);
    EXPECT_LT((norms.asDiagonal() * solution.x - expected).norm(), kSolve * r.norm());
    EXPECT_NEAR(solution.residual_sum_of_squares, (r - scaled * expected).squaredNorm(), kSolve * r.squaredNorm());
  }
}

TEST(SolveLeastSquaresTest, ColumnOfZerosIsLeftAlone) {
  Eigen::MatrixXd j = Noise(11).matrix(50, 3);
  j.col(1).setZero();
  const Eigen::VectorXd r = j.col(0) - 2.0 * j.col(2);
  const LinearSolution solution = solve_least_squares(gram_of(j, r));
  EXPECT_LT((solution.x - Eigen::Vector3d(1, 0, -2)).norm(), kSolve);
  EXPECT_EQ(solution.rank, 2);
  EXPECT_GE(solution.residual_sum_of_squares, 0.0);
}

TEST(SolveLeastSquaresTest, NoUnknowns) {
  const LinearSolution solution = solve_least_squares(Eigen::MatrixXd::Constant(1, 1, 4.0));
  EXPECT_EQ(solution.x.size(), 0);
  EXPECT_EQ(solution.residual_sum_of_squares, 4.0);
}

TEST(PseudoInverseTest, FullRankIsTheInverseAndDeficientNamesTheDirection) {
  const Eigen::MatrixXd j = ill_scaled(100, 4, 12);
  const Eigen::MatrixXd normal = j.transpose() * j;
  const PseudoInverse inverse = scaled_pseudo_inverse(normal);
  const Eigen::VectorXd norms = j.colwise().norm();
  EXPECT_LT((norms.cwiseInverse().asDiagonal() * (normal * inverse.matrix) * norms.asDiagonal() -
             Eigen::MatrixXd::Identity(4, 4))
                .norm(),
            kSolve);
  EXPECT_EQ(inverse.null_space.cols(), 0);

  Eigen::MatrixXd deficient = j;
  deficient.col(3) = 5.0 * deficient.col(1);
  const PseudoInverse pseudo = scaled_pseudo_inverse(deficient.transpose() * deficient);
  EXPECT_EQ(pseudo.rank, 3);
  ASSERT_EQ(pseudo.null_space.cols(), 1);
  const Eigen::VectorXd direction = pseudo.null_space.col(0);
  EXPECT_LT((deficient * direction).norm(), 1e-6);
  EXPECT_NEAR(direction[1] / direction[3], -5.0, 1e-6);
}

struct Deficiency {
  Index columns;
  Index dependent;
};

class CompressedRowsTest : public ::testing::TestWithParam<Deficiency> {};

TEST_P(CompressedRowsTest, KeepCostGradientAndGaussNewtonMatrix) {
  const auto [columns, dependent] = GetParam();
  Eigen::MatrixXd j = ill_scaled(250, columns, 13);
  for (Index k = 0; k < dependent; ++k) j.col(columns - 1 - k) = j.col(0) * std::pow(3.0, static_cast<double>(k));
  const Eigen::VectorXd r = Noise(14).white(250) + 1e3 * j.rowwise().sum();
  const Eigen::MatrixXd gram = gram_of(j, r);
  QrTriangle triangle(columns + 1);
  Eigen::MatrixXd rows(j.rows(), columns + 1);
  rows << j, r;
  add_in_tiles(rows, 64, triangle);
  for (const CompressedRows& compressed : {compress(gram), compress(triangle)}) {
    ASSERT_EQ(compressed.residuals.size(), columns + 1);
    ASSERT_EQ(compressed.jacobian.rows(), columns + 1);
    ASSERT_EQ(compressed.jacobian.cols(), columns);
    EXPECT_LT(distance(gram_of(compressed.jacobian, compressed.residuals), gram), 1e2 * kSum);
    EXPECT_TRUE(compressed.jacobian.row(columns).isZero(0.0));
  }
}

INSTANTIATE_TEST_SUITE_P(All, CompressedRowsTest,
                         ::testing::Values(Deficiency{1, 0}, Deficiency{6, 0}, Deficiency{6, 1}, Deficiency{6, 3},
                                           Deficiency{20, 5}));

}  // namespace
}  // namespace blockid
