// Products and Cholesky factors of every instruction set against Eigen's, for shapes around the sizes of the tiles.
#include <blockid/validation/dense_product.hpp>
#include <blockid/validation/detail/dense_kernels.hpp>

#include "data/message.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace blockid {
namespace {

using detail::DenseKernels;
using detail::InstructionSet;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// What a gap between the columns of C is filled with.
constexpr double kUntouched = 77.0;

MatrixXd numbers(Index rows, Index columns, int seed) {
  return MatrixXd::NullaryExpr(rows, columns, [&](Index i, Index j) {
    return std::sin(0.7 + 1.3 * static_cast<double>(i * i) +
                    2.1 * static_cast<double>(j) * (seed + 0.1 * static_cast<double>(i)));
  });
}

/// Eigenvalues from 1 to about n.
MatrixXd positive_matrix(Index n) {
  const MatrixXd root = numbers(n, n, 3);
  MatrixXd p = root * root.transpose() / static_cast<double>(n);
  p.diagonal().array() += 1.0;
  return p;
}

class DenseKernelsOf : public ::testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    kernels_ = detail::dense_kernels_for(GetParam());
    if (kernels_ == nullptr) GTEST_SKIP() << "this machine lacks the instructions";
  }

  /// C += factor A B with gaps between the columns of C; A and B handed over by rows when they are transposed.
  void expect_product(Index rows, Index columns, Index inner, bool a_by_rows, bool b_by_rows, bool lower) const {
    SCOPED_TRACE(::testing::Message() << rows << " x " << columns << ", inner " << inner << ", by rows " << a_by_rows
                                      << b_by_rows << ", lower " << lower);
    const MatrixXd a = numbers(rows, inner, 1);
    const MatrixXd b = numbers(inner, columns, 2);
    const MatrixXd before = numbers(rows, columns, 5);
    const MatrixXd a_turned = a.transpose();
    const MatrixXd b_turned = b.transpose();
    MatrixXd c = MatrixXd::Constant(rows + 3, columns, kUntouched);
    c.topRows(rows) = before;
    std::vector<double> workspace(detail::kProductWorkspace);
    kernels_->add_product(
        rows, columns, inner, -0.5,
        a_by_rows ? detail::MatrixView{a_turned.data(), inner, 1} : detail::MatrixView{a.data(), 1, rows},
        b_by_rows ? detail::MatrixView{b_turned.data(), columns, 1} : detail::MatrixView{b.data(), 1, inner}, c.data(),
        c.rows(), lower, workspace.data());
    const MatrixXd expected = before - 0.5 * a * b;
    // Sums of `inner` products of numbers below one, in another order.
    const double tolerance = (4.0 + static_cast<double>(inner)) * kEpsilon;
    for (Index j = 0; j < columns; ++j) {
      for (Index i = lower ? j : 0; i < rows; ++i) ASSERT_NEAR(c(i, j), expected(i, j), tolerance) << i << ", " << j;
    }
    EXPECT_EQ(c.bottomRows(3), MatrixXd::Constant(3, columns, kUntouched));
  }

  const DenseKernels* kernels_ = nullptr;
};

TEST_P(DenseKernelsOf, MultiplyMatricesOfOddShapes) {
  // One, around a tile of 4, 8, 12 or 24 rows, around a packed piece of 192 rows and 256 columns.
  for (const auto& [rows, columns, inner] : {std::array<Index, 3>{1, 1, 1},
                                             {3, 5, 2},
                                             {4, 8, 7},
                                             {23, 9, 31},
                                             {24, 8, 1},
                                             {25, 7, 40},
                                             {49, 17, 255},
                                             {191, 33, 256},
                                             {193, 5, 257},
                                             {200, 13, 515},
                                             {7, 1030, 5},
                                             {0, 3, 4},
                                             {3, 0, 4},
                                             {5, 6, 0}}) {
    for (const bool a_by_rows : {false, true}) {
      for (const bool b_by_rows : {false, true}) expect_product(rows, columns, inner, a_by_rows, b_by_rows, false);
    }
  }
}

TEST_P(DenseKernelsOf, LeaveOutTheUpperHalf) {
  for (const Index n : {1, 8, 23, 25, 97, 200, 390}) expect_product(n, n, 40, false, true, true);
}

INSTANTIATE_TEST_SUITE_P(AllSets, DenseKernelsOf,
                         ::testing::Values(InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512));

class CholeskyOf : public ::testing::TestWithParam<Index> {};

TEST_P(CholeskyOf, AgreesWithEigen) {
  const Index n = GetParam();
  const MatrixXd p = positive_matrix(n);
  const CholeskyFactor factor(p);
  ASSERT_TRUE(factor.positive());
  const Eigen::LLT<MatrixXd> expected(p);
  const MatrixXd lower = expected.matrixL();
  // n roundings of the size of P, times a condition number below n.
  const auto size = static_cast<double>(n);
  const double tolerance = 10.0 * kEpsilon * size * (1.0 + p.norm());
  EXPECT_LT((factor.lower() - lower).norm(), tolerance);
  EXPECT_LT((factor.lower() * factor.lower().transpose() - p).norm(), tolerance);
  const MatrixXd inverse = factor.inverse();
  EXPECT_LT((inverse * p - MatrixXd::Identity(n, n)).norm(), tolerance * size);
  EXPECT_EQ(inverse, inverse.transpose());
  const VectorXd b = numbers(n, 1, 4);
  EXPECT_LT((factor.solve(b) - expected.solve(b)).norm(), tolerance * size);
}

TEST_P(CholeskyOf, ReadsTheLowerHalfAlone) {
  const MatrixXd p = positive_matrix(GetParam());
  MatrixXd half = p;
  half.triangularView<Eigen::StrictlyUpper>().setConstant(std::numeric_limits<double>::quiet_NaN());
  const CholeskyFactor factor(half);
  ASSERT_TRUE(factor.positive());
  EXPECT_EQ(factor.lower(), CholeskyFactor(p).lower());
}

// One negative eigenvalue, seen at the last column only.
TEST_P(CholeskyOf, SaysThatAMatrixIsNotPositive) {
  const Index n = GetParam();
  const MatrixXd p = positive_matrix(n);
  MatrixXd raised = p;
  const double last = std::pow(CholeskyFactor(p).lower()(n - 1, n - 1), 2);
  raised(n - 1, n - 1) -= 1.01 * last;
  EXPECT_FALSE(CholeskyFactor(raised).positive());
  raised(n - 1, n - 1) = p(n - 1, n - 1) - 0.99 * last;
  EXPECT_TRUE(CholeskyFactor(raised).positive());
  raised(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(CholeskyFactor(raised).positive());
}

INSTANTIATE_TEST_SUITE_P(Sizes, CholeskyOf, ::testing::Values(1, 2, 47, 48, 49, 96, 97, 150, 301));

TEST(DenseProduct, OfPartsOfMatrices) {
  const MatrixXd a = numbers(70, 50, 1);
  const MatrixXd b = numbers(60, 40, 2);
  const MatrixXd expected = a.block(3, 5, 61, 33) * b.block(7, 2, 33, 31);
  EXPECT_LT((product(a.block(3, 5, 61, 33), b.block(7, 2, 33, 31)) - expected).cwiseAbs().maxCoeff(), 40 * kEpsilon);
}

TEST(DenseProduct, WeightedGram) {
  const MatrixXd a = numbers(61, 43, 1);
  const VectorXd d = numbers(61, 1, 2);
  const MatrixXd gram = weighted_gram(a, d);
  EXPECT_LT((gram - a.transpose() * d.asDiagonal() * a).cwiseAbs().maxCoeff(), 70 * kEpsilon);
  EXPECT_EQ(gram, gram.transpose());
}

TEST(DenseProduct, SizesThatDoNotFitAreNamed) {
  const MatrixXd a = numbers(4, 3, 1);
  EXPECT_THAT(BLOCKID_MESSAGE(product(a, a)), HasSubstr("expected as many rows of B as columns of A, 3, got 4"));
  EXPECT_THAT(BLOCKID_MESSAGE(weighted_gram(a, VectorXd::Ones(3))), HasSubstr("each of 4 rows, got 3"));
  EXPECT_THAT(BLOCKID_MESSAGE(CholeskyFactor(a)), HasSubstr("expected a square matrix, got 4 x 3"));
  const CholeskyFactor unit(MatrixXd::Identity(2, 2));
  EXPECT_THAT(BLOCKID_MESSAGE(unit.solve(VectorXd::Ones(3))), HasSubstr("of 2 numbers, got 3"));
}

}  // namespace
}  // namespace blockid
