#include <blockid/blocks/model.hpp>

#include <blockid/blocks/delay.hpp>
#include <blockid/blocks/gain.hpp>
#include <blockid/blocks/parallel.hpp>
#include <blockid/blocks/polynomial.hpp>
#include <blockid/blocks/rational.hpp>
#include <blockid/blocks/series.hpp>
#include <blockid/blocks/spline.hpp>
#include <blockid/data/error.hpp>
#include <blockid/testing/block_conformance.hpp>

#include <gmock/gmock.h>

namespace blockid {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::UniformNumbers;

// y_t = u_{t-lag} with the lag counted as latency, as by a block that needs to look ahead.
struct Late {
  Index lag = 0;
  Index parameter_count() const { return 0; }
  Index state_count() const { return lag; }
  Index latency() const { return lag; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    Delay(lag).apply(theta, x, u, y);
  }
};

Model wiener_hammerstein() {
  Model model =
      make_model(Series({{"G1", Rational(1, 2)}, {"f", Polynomial(3, {-3.0, 3.0})}, {"G2", Rational(0, 1, 1)}}), 0.1);
  model.parameters << 0.5, 0.25, -0.9, 0.3, /* f */ 0.2, 1.5, -0.3, 0.4, /* G2 */ 2.0, -0.6;
  return model;
}

std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing thrown";
}

TEST(ModelTest, MakeModelTakesTheBlocksOwnStart) {
  const Model model = make_model(Series({{"a", Gain{}}, {"b", Rational(0, 2)}}), 0.25);
  EXPECT_EQ(model.parameters, Eigen::Vector4d(1.0, 1.0, 0.0, 0.0));
  EXPECT_EQ(model.sample_time_s, 0.25);
  EXPECT_EQ(model.initial_state.size(), 0);
}

TEST(ModelTest, SimulateIsTheEquationWrittenOut) {
  const Model model = wiener_hammerstein();
  const Eigen::VectorXd u = UniformNumbers(1).vector(1300);
  const Eigen::VectorXd yhat = simulate(model, u);
  ASSERT_EQ(yhat.size(), u.size());
  double u1 = 0.0, v1 = 0.0, v2 = 0.0, w1 = 0.0, y1 = 0.0;
  for (Index t = 0; t < u.size(); ++t) {
    const double v = 0.5 * u[t] + 0.25 * u1 + 0.9 * v1 - 0.3 * v2;
    const double x = v / 3.0;
    const double w = 0.2 + 1.5 * x - 0.3 * (2.0 * x * x - 1.0) + 0.4 * (4.0 * x * x * x - 3.0 * x);
    const double y = 2.0 * w1 + 0.6 * y1;
    ASSERT_NEAR(yhat[t], y, 1e-12) << t;
    u1 = u[t];
    v2 = v1;
    v1 = v;
    w1 = w;
    y1 = y;
  }
}

TEST(ModelTest, SimulateStartsFromTheInitialState) {
  Model model = make_model(Rational(0, 1));
  model.parameters << 1.0, -0.5;
  model.initial_state = Eigen::VectorXd::Constant(1, 8.0);
  EXPECT_EQ(simulate(model, Eigen::VectorXd::Zero(4)), Eigen::Vector4d(8.0, 4.0, 2.0, 1.0));
}

TEST(ModelTest, SimulateTakesLatencyBack) {
  Model model = make_model(Series({{"", Late{3}}, {"", Gain{}}, {"", Late{2}}}));
  model.parameters << 2.0;
  const Eigen::VectorXd u = UniformNumbers(2).vector(20);
  EXPECT_EQ(simulate(model, u), 2.0 * u) << "five samples late, brought forward by five";
}

TEST(ModelTest, SimulateOfAnEmptyInputIsEmpty) {
  EXPECT_EQ(simulate(wiener_hammerstein(), Eigen::VectorXd()).size(), 0);
  EXPECT_EQ(simulate_signals(wiener_hammerstein(), Eigen::VectorXd()).size(), 4u);
}

TEST(ModelTest, SignalsBetweenTheBlocksAreTheirInputsAndOutputs) {
  Model model = wiener_hammerstein();
  model.initial_state = Eigen::Vector3d(0.5, -0.25, 1.0);
  const Eigen::VectorXd u = UniformNumbers(3).vector(700);
  const std::vector<Eigen::VectorXd> signals = simulate_signals(model, u);
  ASSERT_EQ(signals.size(), 4u);
  EXPECT_EQ(signals[0], u);
  EXPECT_LE((signals[3] - simulate(model, u)).cwiseAbs().maxCoeff(), 1e-13);
  Index state = 0;
  const std::vector<ChildParameters> blocks = top_level_blocks(model);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const Index states = blocks[k].block.state_count();
    const Eigen::VectorXd alone = testing::detail::apply_record(blocks[k].block, blocks[k].parameters,
                                                                model.initial_state.segment(state, states), signals[k])
                                      .y;
    EXPECT_LE((alone - signals[k + 1]).cwiseAbs().maxCoeff(), 1e-13) << blocks[k].label;
    state += states;
  }
}

TEST(ModelTest, SignalsOfBlocksThatLagEndInTheSimulation) {
  // f(0) is not 0 and the filters remember: what a late block sees before and after the record matters.
  Model model = make_model(Series({{"late", Late{4}},
                                   {"G", Rational(1, 1)},
                                   {"f", Polynomial(2, {-2.0, 2.0})},
                                   {"later", Late{3}},
                                   {"H", Rational(0, 1)}}));
  model.parameters << 1.0, 0.5, -0.8, 0.7, 1.0, 0.3, 1.0, -0.5;
  const Eigen::VectorXd u = UniformNumbers(4).vector(60);
  const std::vector<Eigen::VectorXd> signals = simulate_signals(model, u);
  EXPECT_EQ(signals[1], u);
  EXPECT_EQ(signals[4], signals[3]) << "late by three, brought forward by three";
  EXPECT_LE((signals.back() - simulate(model, u)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(ModelTest, SignalsOfASingleBlockAreInputAndOutput) {
  Model model = make_model(Gain{});
  model.parameters << -3.0;
  const Eigen::VectorXd u = UniformNumbers(5).vector(5);
  EXPECT_THAT(simulate_signals(model, u), ::testing::ElementsAre(u, -3.0 * u));
}

TEST(SimulatorTest, PiecesAreTheWholeRecord) {
  Model model = wiener_hammerstein();
  model.initial_state = Eigen::Vector3d(0.1, 0.2, 0.3);
  const Eigen::VectorXd u = UniformNumbers(6).vector(1500);
  const Eigen::VectorXd whole = simulate(model, u);
  Simulator simulator(model);
  Eigen::VectorXd pieces(u.size());
  Index start = 0;
  for (const Index rows : {1, 2, 700, 0, 512, 5, 280}) {
    simulator.push({u.data() + start, static_cast<std::size_t>(rows)},
                   {pieces.data() + start, static_cast<std::size_t>(rows)});
    start += rows;
  }
  ASSERT_EQ(start, u.size());
  EXPECT_LE((pieces - whole).cwiseAbs().maxCoeff(), 1e-12);

  simulator.reset();
  for (Index t = 0; t < 100; ++t) ASSERT_NEAR(simulator.step(u[t]), whole[t], 1e-12) << t;
  EXPECT_EQ(simulator.model().parameters, model.parameters);
}

TEST(SimulatorTest, LatencyShowsAsDelay) {
  Simulator simulator(make_model(Late{2}));
  EXPECT_EQ(simulator.step(5.0), 0.0);
  EXPECT_EQ(simulator.step(6.0), 0.0);
  EXPECT_EQ(simulator.step(7.0), 5.0);
}

TEST(SimulatorTest, RoomThatDoesNotFit) {
  Simulator simulator(make_model(Gain{}));
  const std::vector<double> u(3);
  std::vector<double> yhat(2);
  EXPECT_EQ(complaint([&] { simulator.push(u, yhat); }), "simulator: got 3 inputs and room for 2 outputs");
}

TEST(AdaptStructureTest, PlacesRangesForTheSignalsThatReachThem) {
  Model model = make_model(Series({{"k", Gain{}}, {"f", Polynomial(2)}, {"g", Polynomial(1)}}));
  model.parameters[0] = 10.0;
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(11, -1.0, 3.0);
  const Model adapted = adapt_structure(model, u);
  const auto blocks = top_level_blocks(adapted);
  EXPECT_EQ(blocks[0].parameters[0], 10.0) << "a block that stays keeps its numbers";
  const auto* f = blocks[1].block.target<Polynomial>();
  const auto* g = blocks[2].block.target<Polynomial>();
  EXPECT_EQ(f->range().lower, -10.0);
  EXPECT_EQ(f->range().upper, 30.0);
  EXPECT_NEAR(g->range().lower, -10.0, 1e-12) << "f starts anew as y = u";
  EXPECT_NEAR(g->range().upper, 30.0, 1e-12);
  EXPECT_EQ(blocks[1].parameters, f->initial_parameters());
}

TEST(AdaptStructureTest, ReachesBlocksInNestedRowsAndSums) {
  const Parallel sum({{"a", Series({{"k", Gain{}}, {"f", Polynomial(3)}})}, {"b", Spline(5)}});
  Model model = make_model(Series({{"G", Gain{}}, {"sum", sum}, {"h", Polynomial(1)}}));
  model.parameters[0] = 2.0;
  model.parameters[1] = 10.0;
  const Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(50, -1.0, 2.0);
  const Model adapted = adapt_structure(model, u);
  const auto branches = top_level_blocks(adapted)[1].block.children();
  const auto* f = branches[0].block.children()[1].block.target<Polynomial>();
  EXPECT_EQ(f->range().lower, -20.0);
  EXPECT_EQ(f->range().upper, 40.0);
  EXPECT_EQ(branches[1].block.target<Spline>()->knots().front(), -2.0);
  EXPECT_EQ(branches[1].block.target<Spline>()->knots().back(), 4.0);
  const auto* h = top_level_blocks(adapted)[2].block.target<Polynomial>();
  EXPECT_NEAR(h->range().lower, -22.0, 1e-12) << "10 v + v";
  EXPECT_NEAR(h->range().upper, 44.0, 1e-12);
  EXPECT_EQ(adapted.chain.parameter_names(), model.chain.parameter_names());
}

TEST(AdaptStructureTest, LeavesWhatIsSettled) {
  const Model model = wiener_hammerstein();
  const Model adapted = adapt_structure(model, UniformNumbers(7).vector(30));
  EXPECT_EQ(adapted.parameters, model.parameters);
  const Model once = adapt_structure(make_model(Polynomial(3)), UniformNumbers(8).vector(30));
  const Model twice = adapt_structure(once, 5.0 * UniformNumbers(9).vector(30));
  EXPECT_EQ(twice.chain.arguments(), once.chain.arguments());
  EXPECT_EQ(twice.parameters, once.parameters);
}

TEST(AdaptStructureTest, RefusesASignalThatHasNoRange) {
  EXPECT_THAT(complaint([] { adapt_structure(make_model(Polynomial(2)), Eigen::VectorXd::Constant(5, 2.5)); }),
              AllOf(HasSubstr("polynomial: its input is constant (2.5)"), HasSubstr("two different values")));
  Eigen::VectorXd u = Eigen::VectorXd::LinSpaced(5, 0.0, 1.0);
  u[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(complaint([&] { adapt_structure(make_model(Polynomial(2)), u); }),
              HasSubstr("polynomial: its input is not finite at sample 3"));
  EXPECT_THAT(complaint([] { adapt_structure(make_model(Polynomial(2)), Eigen::VectorXd()); }),
              HasSubstr("polynomial: cannot be placed for an empty signal"));
}

TEST(ModelTest, ParameterIndexFindsNames) {
  const Model model = wiener_hammerstein();
  EXPECT_EQ(parameter_index(model, "G1.b0"), 0);
  EXPECT_EQ(parameter_index(model, "f.c0"), 4);
  EXPECT_EQ(parameter_index(model, "G2.a1"), 9);
  EXPECT_THAT(complaint([&] { parameter_index(model, "G2.a2"); }),
              AllOf(HasSubstr("there is no parameter 'G2.a2'"),
                    HasSubstr("it has G1.b0, G1.b1, G1.a1, G1.a2, f.c0, f.c1, f.c2, f.c3, G2.b0, G2.a1")));
}

TEST(ModelTest, TopLevelBlocksHoldTheirShareOfTheParameters) {
  const auto blocks = top_level_blocks(wiener_hammerstein());
  ASSERT_EQ(blocks.size(), 3u);
  EXPECT_EQ(blocks[1].label, "f");
  EXPECT_EQ(blocks[1].offset, 4);
  EXPECT_EQ(blocks[1].parameters, Eigen::Vector4d(0.2, 1.5, -0.3, 0.4));
  EXPECT_EQ(top_level_blocks(make_model(Gain{})).front().label, "");
}

TEST(ModelTest, CheckNamesWhatIsWrong) {
  const auto broken = [](const std::function<void(Model&)>& damage) {
    Model model = wiener_hammerstein();
    damage(model);
    return complaint([&] { check(model); });
  };
  EXPECT_EQ(broken([](Model&) {}), "nothing thrown");
  EXPECT_EQ(broken([](Model& m) { m.parameters = Eigen::VectorXd::Zero(3); }),
            "model: the chain has 10 parameters, got 3");
  EXPECT_EQ(broken([](Model& m) { m.initial_state = Eigen::VectorXd::Zero(2); }),
            "model: the chain has 3 states, got an initial state of 2");
  EXPECT_EQ(broken([](Model& m) { m.initial_state = Eigen::Vector3d(0.0, HUGE_VAL, 0.0); }),
            "model: the initial state is not finite");
  EXPECT_EQ(broken([](Model& m) { m.sample_time_s = 0.0; }), "model: sample time must be positive, got 0 s");
  EXPECT_EQ(broken([](Model& m) { m.sample_time_s = HUGE_VAL; }), "model: sample time must be positive, got inf s");
  EXPECT_EQ(broken([](Model& m) { m.parameters[5] = std::nan(""); }), "model: parameter f.c1 is not finite");
  Model model = wiener_hammerstein();
  model.parameters = Eigen::VectorXd::Zero(1);
  EXPECT_THAT(complaint([&] { simulate(model, Eigen::VectorXd::Zero(3)); }), HasSubstr("10 parameters, got 1"));
  EXPECT_THAT(complaint([&] { simulate_signals(model, Eigen::VectorXd::Zero(3)); }), HasSubstr("got 1"));
  EXPECT_THAT(complaint([&] { adapt_structure(model, Eigen::VectorXd::Zero(3)); }), HasSubstr("got 1"));
  EXPECT_THAT(complaint([&] { const Simulator simulator(model); }), HasSubstr("got 1"));
}

}  // namespace
}  // namespace blockid
