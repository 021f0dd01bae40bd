// Does the conformance suite see what it is there for? One block for each way to break a law, and exactly the laws that
// it must be found to break.
#include <blockid/blocks/rational.hpp>
#include <blockid/testing/block_conformance_gtest.hpp>

#include <gmock/gmock.h>

#include <stdexcept>

namespace blockid::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

using Numbers = std::span<const double>;

// The sound block that the broken ones vary: y_t = theta_0 u_t + theta_1 x_t, x_{t+1} = u_t, with analytic tangents.
struct Sound {
  Index parameter_count() const { return 2; }
  Index state_count() const { return 1; }
  std::vector<std::string> parameter_names() const { return {"now", "before"}; }
  Eigen::VectorXd initial_parameters() const { return Eigen::Vector2d(1.0, 0.5); }
  bool is_linear() const { return true; }
  bool is_linear_in_parameters() const { return true; }
  std::complex<double> frequency_response(Numbers theta, double omega) const {
    return theta[0] + theta[1] * std::polar(1.0, -omega);
  }
  std::optional<Index> gain_parameter(Numbers) const { return 0; }
  Rescaled with_scaled_output(Numbers theta, double k) const;
  Rescaled with_scaled_input(Numbers theta, double k) const { return with_scaled_output(theta, 1.0 / k); }
  Rescaled with_scaled_signals(Numbers theta, double) const { return with_scaled_output(theta, 1.0); }

  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) {
      y[t] = theta[0] * u[t] + theta[1] * x[0];
      x[0] = u[t];
    }
  }

  // Memory: du/dp of the last sample, for the upstream columns and for x_0(0).
  Index tangent_memory(Index upstream, OwnColumns) const { return upstream + 1; }
  void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                    const Tangents& tangents, OwnColumns own) const {
    double& started = memory[static_cast<std::size_t>(tangents.upstream)];
    for (Index t = 0; t < tangents.rows; ++t) {
      double* row = tangents.row(t);
      for (Index c = 0; c < tangents.upstream; ++c) {
        const double now = row[c];
        row[c] = theta[0] * now + theta[1] * memory[static_cast<std::size_t>(c)];
        memory[static_cast<std::size_t>(c)] = now;
      }
      const std::size_t sample = static_cast<std::size_t>(t);
      tangents.own(t)[0] = u[sample];
      tangents.own(t)[1] = x[0];
      if (own == OwnColumns::parameters_and_state) tangents.own(t)[2] = started == 0.0 ? theta[1] : 0.0;
      started = 1.0;
      y[sample] = theta[0] * u[sample] + theta[1] * x[0];
      x[0] = u[sample];
    }
  }
};

Rescaled Sound::with_scaled_output(Numbers theta, double k) const {
  return {Sound{}, k * Eigen::Map<const Eigen::Vector2d>(theta.data())};
}

// The laws that a block breaks, in the order of the tests.
std::vector<std::string> broken_laws(const AnyBlock& block, const ConformanceOptions& options = {}) {
  const ConformanceReport report = check_block(block, options);
  std::vector<std::string> laws;
  for (const BlockLaw& law : kBlockLaws) {
    if (report.violates(law.name)) laws.emplace_back(law.name);
  }
  return laws;
}

TEST(BrokenBlockTest, TheSoundBlockBreaksNothing) {
  const ConformanceReport report = check_block(Sound{});
  EXPECT_TRUE(report.ok()) << report.text();
  EXPECT_EQ(report.checked.size(), kBlockLaws.size());
  EXPECT_THAT(report.skipped, IsEmpty());
  EXPECT_EQ(report.text(), "conforms");
}

TEST(BrokenBlockTest, ANameTooMany) {
  struct Broken : Sound {
    std::vector<std::string> parameter_names() const { return {"now", "before", "after"}; }
  };
  const ConformanceReport report = check_block(Broken{});
  EXPECT_THAT(report.text(), HasSubstr("number of parameter_names(): expected 2, got 3"));
  EXPECT_THAT(report.skipped, Contains(HasSubstr("tangents = Jets: sizes are wrong")));
}

TEST(BrokenBlockTest, TwoParametersOfOneName) {
  struct Broken : Sound {
    std::vector<std::string> parameter_names() const { return {"k", "k"}; }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("two parameters are called 'k'"));
}

TEST(BrokenBlockTest, InitialParametersTooFew) {
  struct Broken : Sound {
    Eigen::VectorXd initial_parameters() const { return Eigen::VectorXd::Ones(1); }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("size of initial_parameters(): expected 2, got 1"));
}

TEST(BrokenBlockTest, BoundsTooFewOrAwayFromTheStart) {
  struct Short : Sound {
    ParameterBounds bounds() const { return {Eigen::VectorXd::Zero(2), Eigen::VectorXd::Zero(3)}; }
  };
  EXPECT_THAT(check_block(Short{}).text(), HasSubstr("size of bounds().upper: expected 2, got 3"));
  struct Away : Sound {
    ParameterBounds bounds() const { return {Eigen::Vector2d(0.0, 2.0), Eigen::Vector2d(9.0, 9.0)}; }
  };
  EXPECT_THAT(check_block(Away{}).text(), HasSubstr("initial_parameters()[1] lies outside its bounds"));
}

TEST(BrokenBlockTest, ColumnOrderIsNoPermutation) {
  struct Broken : Sound {
    std::vector<Index> column_order(OwnColumns) const { return {0, 1, 1}; }
  };
  EXPECT_THAT(check_block(Broken{}).text(), AllOf(HasSubstr("column_order(parameters) is no permutation"),
                                                  HasSubstr("column_order(parameters and state) is no permutation")));
}

TEST(BrokenBlockTest, GainParameterBeyondTheEnd) {
  struct Broken : Sound {
    std::optional<Index> gain_parameter(Numbers) const { return 2; }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("gain_parameter(): expected an index below 2, got 2"));
}

struct RemembersTheCallBefore {
  mutable double last = 0.0;
  Index parameter_count() const { return 1; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t] + last;
    if constexpr (std::is_same_v<T, double>) last = u.empty() ? 0.0 : u.back();
  }
};

TEST(BrokenBlockTest, RemembersTheCallBefore) { EXPECT_THAT(broken_laws(RemembersTheCallBefore{}), Contains("pure")); }

TEST(BrokenBlockTest, AddsToWhatTheTileHeld) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      std::vector<double> stale;
      for (Index t = 0; t < tangents.rows; ++t) stale.push_back(tangents.own(t)[1]);
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
      for (Index t = 0; t < tangents.rows; ++t) tangents.own(t)[1] += stale[static_cast<std::size_t>(t)];
    }
  };
  EXPECT_THAT(broken_laws(Broken{}),
              ElementsAre("pure", "tangents = Jets", "tangents = differences", "tangents chunked"));
}

struct LooksAhead {
  Index parameter_count() const { return 1; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t + 1 < u.size() ? t + 1 : t];
  }
};

TEST(BrokenBlockTest, LooksAhead) {
  EXPECT_THAT(broken_laws(LooksAhead{}), AllOf(Contains("causal"), Contains("chunked")));
}

struct ForgetsItsStateBetweenPieces : Sound {
  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    Sound::apply(theta, x, u, y);
    x[0] = T(0.0);
  }
};

TEST(BrokenBlockTest, ForgetsItsStateBetweenPieces) {
  EXPECT_THAT(broken_laws(ForgetsItsStateBetweenPieces{}), ElementsAre("chunked", "push value"));
}

TEST(BrokenBlockTest, WritesBeyondItsMemory) {
  struct Broken : Sound {
    Index tangent_memory(Index upstream, OwnColumns own) const { return Sound::tangent_memory(upstream, own) - 1; }
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      Sound::push_forward(theta, x, {memory.data(), memory.size() + 1}, u, y, tangents, own);
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), Contains("stays inside"));
}

struct WritesBeyondItsOutput : Sound {
  template <class T>
  void apply(std::span<const T> theta, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    Sound::apply(theta, x, u, y);
    if constexpr (std::is_same_v<T, double>) {
      if (u.size() == 7) *(y.data() + 7) = 0.0;  // as vector loops without a tail do
    }
  }
};

TEST(BrokenBlockTest, WritesBeyondItsOutput) {
  EXPECT_THAT(broken_laws(WritesBeyondItsOutput{}), Contains("stays inside"));
}

struct OtherValueForJets {
  Index parameter_count() const { return 1; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    const double slip = std::is_same_v<T, double> ? 0.0 : 1e-9;
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t] + slip;
  }
};

TEST(BrokenBlockTest, OtherValueForJets) {
  EXPECT_THAT(broken_laws(OtherValueForJets{}), ElementsAre("Jet value", "push value"));
}

TEST(BrokenBlockTest, OtherValueFromPushForward) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
      y[0] *= 1.0 + 1e-9;
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("push value"));
}

TEST(BrokenBlockTest, LeavesTheStateToPushForward) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      std::vector<double> copy(x.begin(), x.end());
      Sound::push_forward(theta, copy, memory, u, y, tangents, own);
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), AllOf(Contains("push value"), Contains("tangents chunked")));
}

TEST(BrokenBlockTest, WrongSignOfOneDerivative) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
      for (Index t = 0; t < tangents.rows; ++t) tangents.own(t)[1] = -tangents.own(t)[1];
    }
  };
  const ConformanceReport report = check_block(Broken{});
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("tangents = Jets", "tangents = differences"));
  EXPECT_THAT(report.text(), AllOf(HasSubstr("d/d before at t = "), HasSubstr("expected"), HasSubstr("tolerance")));
  EXPECT_THAT(report.text(), Not(HasSubstr("d/d now")));
}

TEST(BrokenBlockTest, WrongDerivativeOfTheInitialState) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
      if (own == OwnColumns::parameters_and_state) tangents.own(0)[2] *= 1.0 + 1e-5;
    }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("d/d x(0)[0] at t = 0"));
}

TEST(BrokenBlockTest, ColumnsInAnOrderOtherThanStated) {
  struct Broken : Sound {
    std::vector<Index> column_order(OwnColumns own) const {
      return own == OwnColumns::parameters ? std::vector<Index>{1, 0} : std::vector<Index>{1, 0, 2};
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("tangents = Jets", "tangents = differences"));
}

TEST(BrokenBlockTest, WrongUpstreamColumnInTheRemainder) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
      if (tangents.upstream % 4 != 3) return;
      for (Index t = 0; t < tangents.rows; ++t) tangents.own(t)[-1] *= 0.99;
    }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("upstream column 10 of 11"));
}

struct DerivativeLostOnTheWayThroughJets {
  Index parameter_count() const { return 1; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t] * T(number(theta[0]));
  }
  static double number(double value) { return value; }
  static double number(const TileJet& value) { return value.a; }
};

TEST(BrokenBlockTest, DerivativeLostOnTheWayThroughJets) {
  ConformanceOptions options;
  options.parameters = Eigen::VectorXd::Constant(1, 0.8);
  EXPECT_THAT(broken_laws(DerivativeLostOnTheWayThroughJets{}, options), ElementsAre("tangents = differences"));
}

TEST(BrokenBlockTest, ForgetsItsTangentsAtTileBorders) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      std::fill_n(memory.begin(), tangents.upstream, 0.0);
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("tangents = Jets", "tangents = differences", "tangents chunked"));
}

TEST(BrokenBlockTest, SeedsTheInitialStateAnewInEachTile) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      memory[static_cast<std::size_t>(tangents.upstream)] = 0.0;
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("tangents = Jets", "tangents = differences", "tangents chunked"));
}

TEST(BrokenBlockTest, PacksRowsWithTheWrongSign) {
  struct Broken : Sound {
    bool push_negated(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, double* target) const {
      Sound::push_forward(theta, x, memory, u, y, tangents, OwnColumns::parameters);
      for (Index t = 0; t < tangents.rows; ++t) target = std::copy_n(tangents.row(t), tangents.upstream + 2, target);
      return true;
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("packed rows"));
}

TEST(BrokenBlockTest, PacksRowsBehindTheLast) {
  struct Broken : Sound {
    bool push_negated(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, double* target) const {
      Sound::push_forward(theta, x, memory, u, y, tangents, OwnColumns::parameters);
      for (Index t = 0; t < tangents.rows; ++t) {
        for (Index c = 0; c < tangents.upstream + 2; ++c) *target++ = -tangents.row(t)[c];
      }
      *target = 0.0;
      return true;
    }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("wrote behind its last row"));
}

TEST(BrokenBlockTest, BendsTangents) {
  struct Broken : Sound {
    void push_forward(Numbers theta, std::span<double> x, std::span<double> memory, Numbers u, std::span<double> y,
                      const Tangents& tangents, OwnColumns own) const {
      for (Index t = 0; t < tangents.rows; ++t) {
        for (Index c = 0; c < tangents.upstream; ++c)
          tangents.row(t)[c] += 1e-8 * tangents.row(t)[c] * tangents.row(t)[c];
      }
      Sound::push_forward(theta, x, memory, u, y, tangents, own);
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("tangents = Jets", "tangents linear"));
}

struct CallsItselfLinearWithAnOffset {
  Index parameter_count() const { return 1; }
  bool is_linear() const { return true; }
  std::complex<double> frequency_response(Numbers, double) const { return 1.0; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = u[t] + theta[0];
  }
};

TEST(BrokenBlockTest, CallsItselfLinearWithAnOffset) {
  EXPECT_THAT(broken_laws(CallsItselfLinearWithAnOffset{}), Contains("superposition"));
}

// x counts samples: linear in u, but not the same tomorrow.
struct VariesInTime {
  Index parameter_count() const { return 0; }
  Index state_count() const { return 1; }
  bool is_linear() const { return true; }
  template <class T>
  void apply(std::span<const T>, std::span<T> x, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) {
      y[t] = (1.0 + 1e-3 * x[0]) * u[t];
      x[0] += 1.0;
    }
  }
};

TEST(BrokenBlockTest, VariesInTime) {
  ConformanceOptions options;
  options.require_frequency_response = false;
  EXPECT_THAT(broken_laws(VariesInTime{}, options), ElementsAre("shift invariance"));
  EXPECT_THAT(check_block(VariesInTime{}).text(), HasSubstr("a linear block has no frequency_response()"));
}

TEST(BrokenBlockTest, FrequencyResponseOfTheWrongSign) {
  struct Broken : Sound {
    std::complex<double> frequency_response(Numbers theta, double omega) const {
      return std::conj(Sound::frequency_response(theta, omega));
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("frequency response"));
}

struct FrequencyResponseOfABlockThatIsNotLinear {
  Index parameter_count() const { return 0; }
  std::complex<double> frequency_response(Numbers, double) const { return 1.0; }
  template <class T>
  void apply(std::span<const T>, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = u[t] * u[t];
  }
};

TEST(BrokenBlockTest, FrequencyResponseOfABlockThatIsNotLinear) {
  EXPECT_THAT(broken_laws(FrequencyResponseOfABlockThatIsNotLinear{}), ElementsAre("frequency response"));
}

struct CallsItselfLinearInParameters {
  Index parameter_count() const { return 1; }
  bool is_linear_in_parameters() const { return true; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * theta[0] * u[t];
  }
};

TEST(BrokenBlockTest, CallsItselfLinearInParameters) {
  EXPECT_THAT(broken_laws(CallsItselfLinearInParameters{}), ElementsAre("linear in parameters"));
}

TEST(BrokenBlockTest, ScalesItsInputByTheAbsoluteFactor) {
  struct Broken : Sound {
    Rescaled with_scaled_input(Numbers theta, double k) const { return Sound::with_scaled_input(theta, std::abs(k)); }
  };
  const ConformanceReport report = check_block(Broken{});
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("scaled input"));
  EXPECT_THAT(report.text(), AllOf(HasSubstr("k = -0.75"), Not(HasSubstr("k = 2.5"))));
}

TEST(BrokenBlockTest, ScalesOneOfItsOutputs) {
  struct Broken : Sound {
    Rescaled with_scaled_output(Numbers theta, double k) const {
      return {Sound{}, Eigen::Vector2d(k * theta[0], theta[1])};
    }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("scaled output"));
}

TEST(BrokenBlockTest, ScaledSignalsThatScaleOnce) {
  struct Broken : Sound {
    Rescaled with_scaled_signals(Numbers theta, double k) const { return with_scaled_output(theta, k); }
  };
  EXPECT_THAT(broken_laws(Broken{}), ElementsAre("scaled signals"));
}

struct AdaptsAgainAndAgain {
  double width = 1.0;
  Index parameter_count() const { return 1; }
  Arguments arguments() const { return {{"width", std::to_string(width)}}; }
  AdaptsAgainAndAgain adapted_to(std::span<const double> v) const { return {*std::max_element(v.begin(), v.end())}; }
  template <class T>
  void apply(std::span<const T> theta, std::span<T>, std::span<const T> u, std::span<T> y) const {
    for (std::size_t t = 0; t < u.size(); ++t) y[t] = theta[0] * u[t] / width;
  }
};

TEST(BrokenBlockTest, AdaptsAgainAndAgain) { EXPECT_THAT(broken_laws(AdaptsAgainAndAgain{}), ElementsAre("adapted")); }

TEST(BrokenBlockTest, Throws) {
  struct Broken : Sound {
    std::complex<double> frequency_response(Numbers, double omega) const {
      if (omega > 1.0) throw std::domain_error("no frequencies above 1");
      return 1.0;
    }
  };
  EXPECT_THAT(check_block(Broken{}).text(), HasSubstr("it threw \"no frequencies above 1\""));
}

TEST(BrokenBlockTest, OutputThatIsNotFiniteAsksForOtherParameters) {
  ConformanceOptions options;
  options.parameters = Eigen::Vector2d(1.0, -1e9);  // b0, a1: a pole at 1e9
  EXPECT_THAT(check_block(Rational(0, 1), options).text(), HasSubstr("y is not finite at the chosen parameters"));
}

TEST(BrokenBlockTest, ParametersOfTheWrongSize) {
  ConformanceOptions options;
  options.parameters = Eigen::VectorXd::Zero(5);
  EXPECT_THAT(check_block(Sound{}, options).text(),
              HasSubstr("size of ConformanceOptions::parameters: expected 2, got 5"));
}

TEST(BrokenBlockTest, TheMatcherExplains) {
  struct Broken : Sound {
    std::complex<double> frequency_response(Numbers, double) const { return 0.0; }
  };
  std::ostringstream explanation;
  EXPECT_FALSE(ConformsToBlockLaws().MatchAndExplain(Broken{}, &explanation));
  EXPECT_THAT(explanation.str(), HasSubstr("law 'frequency response'"));
  EXPECT_THAT(Broken{}, Not(ConformsToBlockLaws()));
  EXPECT_THAT(AnyBlock(Sound{}), ConformsToBlockLaws());
  EXPECT_EQ(::testing::PrintToString(AnyBlock(Sound{})), "a block of kind custom with 2 parameters and 1 states");
}

}  // namespace
}  // namespace blockid::testing
