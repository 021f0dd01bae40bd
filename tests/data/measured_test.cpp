// Public measured records. The expected figures were computed with scipy.io.loadmat and numpy.loadtxt.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "blockid/data/error.hpp"
#include "blockid/data/load.hpp"
#include "blockid/data/mat.hpp"
#include "support/data_dir.hpp"

namespace blockid {
namespace {

struct Expected {
  Eigen::Index count;
  double first;
  double last;
  double mean;
  double std;
};

void expect_signal(const Eigen::VectorXd& x, const Expected& expected) {
  ASSERT_EQ(x.size(), expected.count);
  EXPECT_EQ(x[0], expected.first);
  EXPECT_EQ(x[x.size() - 1], expected.last);
  EXPECT_NEAR(x.mean(), expected.mean, 1e-12 * expected.std);
  EXPECT_NEAR(std::sqrt((x.array() - x.mean()).square().mean()), expected.std, 1e-12 * expected.std);
}

LoadSpec spec(const std::filesystem::path& path, const std::string& input, const std::string& output) {
  LoadSpec result;
  result.path = path;
  result.input = input;
  result.output = output;
  return result;
}

TEST(MeasuredTest, WienerHammersteinBenchmark2009) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "wh2009/WienerHammerBenchMark.mat");
  LoadSpec benchmark = spec(path, "uBenchMark", "yBenchMark");
  benchmark.rate_from = "fs";
  const Record record = load_record(benchmark);
  EXPECT_EQ(record.sample_time_s, 1.0 / 51200.0);
  expect_signal(record.u,
                {188000, -0.11604953411733732, -0.005836810887558386, -0.00387449004270859, 0.6598372495379723});
  expect_signal(record.y,
                {188000, 0.0834320615103934, -0.006523494521388784, -0.03890106068633573, 0.23847243774199633});
}

TEST(MeasuredTest, RobotArm) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "robot_arm/contsid_robotarm.mat");
  LoadSpec arm = spec(path, "Input", "Output");
  arm.sample_time_from = "Ts";
  const Record record = load_record(arm);
  EXPECT_EQ(record.sample_time_s, 0.002);
  EXPECT_EQ(load_scalar(path, "fs"), 500.0);
  expect_signal(record.u, {40960, -0.2522031050485674, -0.1789423411400382, 0.009220841442325146, 0.1711749168656962});
  expect_signal(record.y, {40960, 0.19064351496259255, 0.1873329389542601, 0.002772005402989839, 0.28774573848897117});
  EXPECT_THROW(static_cast<void>(load_column(path, "G")), Error) << "G is complex";
}

TEST(MeasuredTest, RobotArmFromDaisy) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "robot_arm/robot_arm.dat");
  expect_signal(load_column(path, "1"), {1024, 0.22183165, 0.29035137, 1.1790039214018555e-10, 0.16443001815129843});
  expect_signal(load_column(path, "2"), {1024, -0.1770363, -0.1671642, -8.696093996805876e-11, 0.2750979588703361});
}

TEST(MeasuredTest, SilverboxArrow) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "silverbox/SNLS80mV.mat");
  LoadSpec arrow = spec(path, "V1", "V2");
  arrow.rate_hz = 610.35;
  const Record record = load_record(arrow);
  expect_signal(record.u,
                {131072, 0.005775621745857643, 0.009673175849043763, 0.006181706303271125, 0.02192041247000454});
  expect_signal(record.y,
                {131072, 0.00939780341827427, -0.007224712725199061, 0.0008159950340565912, 0.0533694668269622});
}

TEST(MeasuredTest, SilverboxSchroeder) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "silverbox/Schroeder80mV.mat");
  expect_signal(load_column(path, "V1"),
                {131072, 0.005884968169691274, 0.033898427073471245, 0.006232686199941548, 0.026799459310926893});
  expect_signal(load_column(path, "V2"),
                {131072, 0.03331526763360016, 0.11841635826679413, 0.0008285951597872235, 0.06304717227580832});
}

TEST(MeasuredTest, CascadedTanks) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "cascaded_tanks/dataBenchmark.mat");
  LoadSpec tanks = spec(path, "uEst", "yEst");
  tanks.sample_time_from = "Ts";
  const Record record = load_record(tanks);
  EXPECT_EQ(record.sample_time_s, 4.0);
  expect_signal(record.u, {1024, 3.2567230505556095, 3.26145652099497, 2.8, 0.9995115994824673});
  expect_signal(record.y, {1024, 5.205004959182117, 3.683070115205615, 5.582729231040664, 2.1651354198021573});
  expect_signal(load_column(path, "yVal"),
                {1024, 4.972762645914397, 3.7178606851300833, 5.736466856927595, 2.099334841381135});
}

TEST(MeasuredTest, WienerHammersteinProcessNoiseEstimation) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "wh_process_noise/WH_EstimationExample.mat");
  const MatFile file(path);
  const Eigen::MatrixXd u = file.matrix("dataMeas.u");
  EXPECT_EQ(u.rows(), 8192);
  EXPECT_EQ(u.cols(), 10);
  EXPECT_EQ(u(0, 0), 0.0025824829936027527);
  EXPECT_EQ(u(8191, 9), -0.42790867388248444);
  EXPECT_NEAR(u.mean(), 0.02123583323409548, 1e-14);
  EXPECT_EQ(file.vector("dataMeas.y[9]")[8191], 0.16187554132193327);
  EXPECT_EQ(file.scalar("dataMeas.fs"), 78125.0);
  EXPECT_THAT([&] { static_cast<void>(file.vector("dataMeas.y")); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("add [k]")));
}

TEST(MeasuredTest, WienerHammersteinProcessNoiseTest) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "wh_process_noise/WH_TestDataset.mat");
  LoadSpec multisine = spec(path, "dataMeas.r[0]", "dataMeas.y[0]");
  multisine.rate_from = "dataMeas.fs";
  const Record record = load_record(multisine);
  EXPECT_EQ(record.sample_time_s, 1.0 / 78125.0);
  ASSERT_EQ(record.u.size(), 16384);
  EXPECT_EQ(record.u[0], 0.6846179927273349);
  EXPECT_EQ(record.y[0], -0.03585458919405937);
  EXPECT_EQ(load_column(path, "dataMeas.y[1]")[16383], 0.012481988407671452);
}

TEST(MeasuredTest, HeatExchanger) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "daisy/exchanger.dat");
  LoadSpec exchanger = spec(path, "2", "3");
  exchanger.sample_time_s = 1.0;
  const Record record = load_record(exchanger);
  expect_signal(record.u, {4000, 0.3, 0.66734848, 0.36911420025249997, 0.16135370012854933});
  expect_signal(record.y, {4000, 98.6281, 95.5231, 96.93582655, 1.671034341131294});
}

TEST(MeasuredTest, CdPlayerArm) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "daisy/CD_player_arm.dat");
  EXPECT_EQ(describe_file(path).columns.size(), 4U);
  expect_signal(load_column(path, "1"), {2048, 0.0531, 0.1441, -0.025379541015625, 0.2257696131871083});
  expect_signal(load_column(path, "4"), {2048, 0.0342, 0.1892, 0.00502275390625, 0.5257312272636564});
}

TEST(MeasuredTest, HeatingSystem) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "daisy/heating_system.dat");
  expect_signal(load_column(path, "2"), {801, 9.0, 6.0, 6.249687890137328, 2.2206786710970445});
  expect_signal(load_column(path, "3"), {801, 129.32, 120.536, 133.98402496878902, 34.71504728449063});
}

TEST(MeasuredTest, PositioningSystem) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "closed_loop/DATA_EMPS.mat");
  expect_signal(load_column(path, "vir"),
                {24841, 2.5386280888756465, -0.9527324301869854, -0.0922836620382495, 1.536415258033936});
  expect_signal(load_column(path, "qm"), {24841, 7.45e-06, 0.00361505, 0.12376441520470188, 0.08266224040905007});
  EXPECT_EQ(load_scalar(path, "gtau"), 35.15065188248547);
}

TEST(MeasuredTest, BallAndBeam) {
  BLOCKID_DATA_FILE_OR_SKIP(path, "closed_loop/ball_beam_05_multisine_01.mat");
  expect_signal(load_column(path, "u"),
                {60001, 0.5947396709194437, 1.0599322042268335, 0.843018489039866, 1.9295807536859138});
  expect_signal(load_column(path, "y"), {60001, -0.13671875, -0.2685546875, -0.28106961563661437, 1.314292628220318});
}

}  // namespace
}  // namespace blockid
