// Measured problems: splits, units and what is said when a record is missing.
#include <blockid/data/error.hpp>
#include <blockid/data/mat.hpp>
#include <blockid/problems/catalogue.hpp>
#include <blockid/problems/measured.hpp>

#include "support/data_dir.hpp"
#include "support/temp_dir.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace blockid::problems {
namespace {

using blockid::testing::data_dir;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(MeasuredProblems, MissingRecordsAreNamed) {
  const blockid::testing::TempDir empty;
  int measured = 0;
  for (const CatalogueEntry& entry : catalogue(empty.path())) {
    if (!entry.measured) continue;
    ++measured;
    EXPECT_THAT([&] { entry.load(); }, ThrowsMessage<Error>(HasSubstr("BLOCKID_DATA_DIR"))) << entry.name;
    EXPECT_THAT([&] { entry.load(); }, ThrowsMessage<Error>(HasSubstr(empty.path().string()))) << entry.name;
  }
  EXPECT_EQ(measured, 6);
}

TEST(MeasuredProblems, RobotArm) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "robot_arm/contsid_robotarm.mat");
  const Problem problem = robot_arm(data_dir());
  for (const DataSet& data : {problem.train, problem.test}) {
    ASSERT_EQ(data.records.size(), 1U);
    const Record& record = data.records.front();
    EXPECT_EQ(record.u.size(), 4096);
    EXPECT_EQ(record.period, 4096);
    EXPECT_DOUBLE_EQ(record.sample_time_s, 0.002);
  }
  // The input repeats; measured, it does so up to its noise, a fifth of it. Unrelated periods would differ by sqrt(2).
  const Eigen::VectorXd& fifth = problem.train.records.front().u;
  const Eigen::VectorXd& seventh = problem.test.records.front().u;
  EXPECT_LT((fifth - seventh).norm(), 0.5 * fifth.norm());
  EXPECT_GT((fifth - seventh).norm(), 0.0);
}

TEST(MeasuredProblems, WienerHammerstein2009) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "wh2009/WienerHammerBenchMark.mat");
  const Problem problem = wiener_hammerstein_2009(data_dir());
  EXPECT_EQ(total_samples(problem.train), 100000);
  EXPECT_EQ(total_samples(problem.test), 78800);
  EXPECT_EQ(problem.warmup, 50);
  EXPECT_EQ(problem.unit, "mV");
  // In V the output is below one; in mV its deviation is a few hundred.
  EXPECT_GT(problem.train.records[0].y.cwiseAbs().maxCoeff(), 100.0);
  for (const PublishedFigure& figure : problem.published) EXPECT_EQ(figure.unit, problem.unit) << figure.method;
}

TEST(MeasuredProblems, ProcessNoise) {
  BLOCKID_DATA_FILE_OR_SKIP(train, "wh_process_noise/WH_EstimationExample.mat");
  BLOCKID_DATA_FILE_OR_SKIP(test, "wh_process_noise/WH_TestDataset.mat");
  const Problem problem = wiener_hammerstein_process_noise(data_dir());
  EXPECT_EQ(problem.train.records.size(), 10U);
  EXPECT_EQ(problem.test.records.size(), 2U);
  EXPECT_EQ(problem.test.records[1].u.size(), 16384);
  for (const Record& record : problem.train.records) EXPECT_EQ(record.period, record.u.size());
}

/// The measured input of every record lies equally many samples ahead of the input of the problem.
TEST(MeasuredProblems, ProcessNoiseHasOneDelay) {
  BLOCKID_DATA_FILE_OR_SKIP(train, "wh_process_noise/WH_EstimationExample.mat");
  const Problem problem = wiener_hammerstein_process_noise(data_dir());
  const Eigen::MatrixXd acquired = MatFile(train).matrix("dataMeas.u");
  const auto product = [](const Eigen::VectorXd& u, const Eigen::VectorXd& r, Eigen::Index lead) {
    double sum = 0.0;
    for (Eigen::Index t = 0; t < u.size(); ++t) sum += u[t] * r[(t + lead) % r.size()];
    return sum;
  };
  for (Eigen::Index k = 0; k < acquired.cols(); ++k) {
    const Eigen::VectorXd& r = problem.train.records[static_cast<std::size_t>(k)].u;
    const double at_11 = product(acquired.col(k), r, 11);
    EXPECT_GT(at_11, product(acquired.col(k), r, 10)) << "realisation " << k;
    EXPECT_GT(at_11, product(acquired.col(k), r, 12)) << "realisation " << k;
  }
}

TEST(MeasuredProblems, HeatExchanger) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "daisy/exchanger.dat");
  const Problem problem = heat_exchanger(data_dir());
  EXPECT_EQ(total_samples(problem.train), 3000);
  EXPECT_EQ(total_samples(problem.test), 1000);
}

TEST(MeasuredProblems, CascadedTanks) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "cascaded_tanks/dataBenchmark.mat");
  const Problem problem = cascaded_tanks(data_dir());
  EXPECT_EQ(total_samples(problem.train), 1024);
  EXPECT_EQ(problem.train.records[0].sample_time_s, 4.0);
  EXPECT_NE(problem.train.records[0].y, problem.test.records[0].y);
}

TEST(MeasuredProblems, Silverbox) {
  BLOCKID_DATA_FILE_OR_SKIP(file, "silverbox/SNLS80mV.mat");
  const Problem problem = silverbox(data_dir());
  EXPECT_EQ(total_samples(problem.train), 105712 - 40650);
  EXPECT_EQ(total_samples(problem.test), 40475);
}

}  // namespace
}  // namespace blockid::problems
