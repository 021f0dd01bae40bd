// Correlations of short sequences by hand.
#include <blockid/validation/masked_correlation.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Index>(values.size()));
}

TEST(Correlation, OfKnownSequences) {
  // Deviations from the mean 2: -1, 0, 1, 0, -1, 1.
  const VectorXd x = vector({1, 2, 3, 2, 1, 3});
  const VectorXd r = autocorrelation(x, VectorXd::Ones(6), 2);
  ASSERT_EQ(r.size(), 3);
  EXPECT_DOUBLE_EQ(r[0], 1.0);
  EXPECT_DOUBLE_EQ(r[1], -1.0 / 4.0);
  EXPECT_DOUBLE_EQ(r[2], (-1.0 + 0.0 - 1.0 + 0.0) / 4.0);
}

TEST(Correlation, MaskedSamplesTakeNoPart) {
  // The masked sample may be anything, even NaN; the mean is that of the others.
  VectorXd x = vector({1, std::nan(""), 3, 2});
  const VectorXd r = autocorrelation(x, vector({1, 0, 1, 1}), 3);
  EXPECT_DOUBLE_EQ(r[1], 0.0);         // only 1 * 0 between the third and fourth
  EXPECT_DOUBLE_EQ(r[2], -1.0 / 2.0);  // first and third
  EXPECT_DOUBLE_EQ(r[3], 0.0);
}

TEST(Correlation, RecordsShareTheirMean) {
  // Mean of 1, 2, 6 is 3: deviations -2, -1 and 3; one pair, (-2)(-1), within a record.
  const MaskedSignal records[] = {{vector({1, 2}), VectorXd::Ones(2)}, {vector({6}), VectorXd::Ones(1)}};
  const PairSums sums = pair_sums(records, 1);
  EXPECT_DOUBLE_EQ(sums.products[0], 14.0);
  EXPECT_DOUBLE_EQ(sums.products[1], 2.0);
  EXPECT_DOUBLE_EQ(sums.counts[0], 3.0);
  EXPECT_DOUBLE_EQ(sums.counts[1], 1.0);
}

}  // namespace
}  // namespace blockid
