// Every set of inner loops against plain loops, at every order and in every remainder of the vector widths.
#include <blockid/blocks/detail/kernels.hpp>
#include <blockid/testing/block_conformance.hpp>

#include <gmock/gmock.h>

namespace blockid::detail {
namespace {

using blockid::testing::UniformNumbers;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Sums of at most 30 terms of order one, contracted to fused operations or not, behind a stable recursion.
constexpr double kRounding = 1e-12;

Index padded(Index n) { return (n + 7) / 8 * 8; }

// Coefficients b, a: (order + 1,) of a stable filter; a_0 is garbage, for nobody may read it.
struct Filter {
  Eigen::VectorXd b;
  Eigen::VectorXd a;
  Index order;

  Filter(Index n, UniformNumbers& numbers) : b(numbers.vector(n + 1)), a(numbers.vector(n + 1)), order(n) {
    a *= 0.9 / std::max(1.0, a.tail(n).lpNorm<1>());
    a[0] = kNaN;
  }

  // One sample of the transposed direct form II; z: (order,).
  double step(double u, Eigen::VectorXd& z) const {
    if (order == 0) return b[0] * u;
    const double y = b[0] * u + z[0];
    for (Index k = 0; k < order; ++k) {
      z[k] = (k + 1 < order ? z[k + 1] : 0.0) + b[k + 1] * u - a[k + 1] * y;
    }
    return y;
  }
};

class KernelsTest : public ::testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    kernels_ = kernels_for(GetParam());
    if (kernels_ == nullptr) GTEST_SKIP() << "this machine or build has no such kernels";
  }

  const Kernels* kernels_ = nullptr;
};

std::string name_of(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline:
      return "baseline";
    case InstructionSet::avx2:
      return "avx2";
    case InstructionSet::avx512:
      return "avx512";
  }
  return "unknown";
}

INSTANTIATE_TEST_SUITE_P(Sets, KernelsTest,
                         ::testing::Values(InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512),
                         [](const auto& set) { return name_of(set.param); });

TEST(KernelChoiceTest, BaselineIsAlwaysThereAndTheBestSetIsChosen) {
  ASSERT_NE(kernels_for(InstructionSet::baseline), nullptr);
  const Kernels* best = kernels_for(InstructionSet::baseline);
  for (const InstructionSet set : {InstructionSet::avx2, InstructionSet::avx512}) {
    if (kernels_for(set) != nullptr) best = kernels_for(set);
  }
  EXPECT_STREQ(kernels().name, best->name);
}

TEST_P(KernelsTest, NameSaysWhichSetItIs) { EXPECT_EQ(kernels_->name, name_of(GetParam())); }

TEST_P(KernelsTest, FilterSignalIsTheRecursion) {
  UniformNumbers numbers(1);
  for (Index order = 0; order <= 12; ++order) {
    for (const Index n : {0, 1, 2, 3, 4, 5, 7, 8, 9, 11, 13, 64, 101}) {
      const Filter filter(order, numbers);
      const Eigen::VectorXd u = numbers.vector(n);
      Eigen::VectorXd z = numbers.vector(order);
      Eigen::VectorXd z_expected = z;
      Eigen::VectorXd y = Eigen::VectorXd::Constant(n + 1, kNaN);
      kernels_->filter_signal(filter.b.data(), filter.a.data(), order, z.data(), u.data(), y.data(), n);
      for (Index t = 0; t < n; ++t) {
        ASSERT_NEAR(y[t], filter.step(u[t], z_expected), kRounding) << "order " << order << ", n " << n << ", t " << t;
      }
      for (Index k = 0; k < order; ++k) {
        ASSERT_NEAR(z[k], z_expected[k], kRounding) << "order " << order << ", n " << n << ", state " << k;
      }
      ASSERT_TRUE(std::isnan(y[n])) << "wrote beyond the end, order " << order << ", n " << n;
    }
  }
}

TEST_P(KernelsTest, FilterColumnsIsTheRecursionInEachColumn) {
  UniformNumbers numbers(2);
  for (Index order = 0; order <= 12; ++order) {
    for (const Index columns : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12, 13, 15, 16, 17, 23, 24, 33}) {
      const Filter filter(order, numbers);
      const Index rows = 9;
      const Index stride = padded(columns) + 8;
      const Index state_stride = padded(columns);
      // One number before the tile puts it out of every alignment.
      Eigen::VectorXd tile = Eigen::VectorXd::Constant(1 + rows * stride, kNaN);
      double* data = tile.data() + 1;
      Eigen::VectorXd states = Eigen::VectorXd::Zero(1 + order * state_stride);
      Eigen::MatrixXd expected(rows, columns);
      Eigen::MatrixXd z_expected(order, columns);
      for (Index c = 0; c < columns; ++c) {
        Eigen::VectorXd z = numbers.vector(order);
        for (Index k = 0; k < order; ++k) states[1 + k * state_stride + c] = z[k];
        for (Index t = 0; t < rows; ++t) {
          const double u = numbers.next();
          data[t * stride + c] = u;
          expected(t, c) = filter.step(u, z);
        }
        z_expected.col(c) = z;
      }
      kernels_->filter_columns(filter.b.data(), filter.a.data(), order, states.data() + 1, state_stride, data, rows,
                               stride, columns);
      for (Index c = 0; c < columns; ++c) {
        for (Index t = 0; t < rows; ++t) {
          ASSERT_NEAR(data[t * stride + c], expected(t, c), kRounding)
              << "order " << order << ", columns " << columns << ", column " << c << ", t " << t;
        }
        for (Index k = 0; k < order; ++k) {
          ASSERT_NEAR(states[1 + k * state_stride + c], z_expected(k, c), kRounding)
              << "order " << order << ", columns " << columns << ", column " << c << ", state " << k;
        }
      }
      ASSERT_TRUE(states.allFinite()) << "stale numbers came into the state, order " << order;
      for (Index t = 0; t < rows; ++t) {
        for (Index c = padded(columns); c < stride; ++c) {
          ASSERT_TRUE(std::isnan(data[t * stride + c])) << "wrote to column " << c << " of " << columns;
        }
      }
    }
  }
}

TEST_P(KernelsTest, FilterTangentsContinueFromTheirHistoryAndFilterAsTheFilter) {
  UniformNumbers numbers(3);
  for (Index order = 0; order <= 12; ++order) {
    for (const Index n : {1, 2, 5, 8, 33}) {
      const Filter filter(order, numbers);
      const Eigen::VectorXd u = numbers.vector(n);
      Eigen::VectorXd z = numbers.vector(order);
      Eigen::VectorXd z_expected = z;
      Eigen::VectorXd y_expected(n);
      kernels_->filter_signal(filter.b.data(), filter.a.data(), order, z_expected.data(), u.data(), y_expected.data(),
                              n);
      const Eigen::VectorXd s_past = numbers.vector(order);
      const Eigen::VectorXd r_past = numbers.vector(order);
      // Oldest first, as the recursion is written; the kernel keeps both newest first.
      Eigen::VectorXd s_expected(order + n);
      Eigen::VectorXd r_expected(order + n);
      s_expected.head(order) = s_past.reverse();
      r_expected.head(order) = r_past.reverse();
      for (Index t = 0; t < n; ++t) {
        s_expected[order + t] = u[t];
        r_expected[order + t] = -y_expected[t];
        for (Index k = 1; k <= order; ++k) {
          s_expected[order + t] -= filter.a[k] * s_expected[order + t - k];
          r_expected[order + t] -= filter.a[k] * r_expected[order + t - k];
        }
      }
      Eigen::VectorXd s(n + order);
      Eigen::VectorXd r(n + order);
      s << Eigen::VectorXd::Constant(n, kNaN), s_past;
      r << Eigen::VectorXd::Constant(n, kNaN), r_past;
      Eigen::VectorXd y(n);
      kernels_->filter_tangents(filter.b.data(), filter.a.data(), order, z.data(), u.data(), y.data(), s.data(),
                                r.data(), n);
      ASSERT_LE((y - y_expected).cwiseAbs().maxCoeff(), kRounding) << "order " << order << ", n " << n;
      ASSERT_LE((z - z_expected).lpNorm<1>(), kRounding) << "order " << order << ", n " << n;
      ASSERT_LE((s.reverse() - s_expected).cwiseAbs().maxCoeff(), kRounding) << "order " << order << ", n " << n;
      ASSERT_LE((r.reverse() - r_expected).cwiseAbs().maxCoeff(), kRounding) << "order " << order << ", n " << n;
    }
  }
}

TEST_P(KernelsTest, ShiftedColumnsReadASignalStoredNewestFirst) {
  UniformNumbers numbers(8);
  for (const Index count : {0, 1, 2, 3, 4, 5, 7, 8, 9, 12, 17}) {
    const Index rows = 6;
    for (const Index room : {count, count + 1, count + 8}) {
      const Index stride = room + 3;
      const Eigen::VectorXd signal = numbers.vector(rows + count + detail::kShiftedSignalGuard);
      const Eigen::VectorXd before = numbers.vector(rows * stride);
      Eigen::VectorXd tile = before;
      kernels_->shifted_columns(signal.data(), tile.data(), rows, stride, count, room);
      for (Index t = 0; t < rows; ++t) {
        for (Index c = 0; c < stride; ++c) {
          if (c >= count && c < room) continue;
          const Index place = t * stride + c;
          ASSERT_EQ(tile[place], c < count ? signal[rows - 1 - t + c] : before[place])
              << "row " << t << ", column " << c << ", room " << room;
        }
      }
    }
  }
}

TEST_P(KernelsTest, NegatedRowsPackAndReportWhatIsNotFinite) {
  UniformNumbers numbers(9);
  for (const Index columns : {1, 3, 4, 7, 8, 9, 16, 20}) {
    const Index rows = 5;
    const Index stride = padded(columns);
    Eigen::VectorXd tile = numbers.vector(rows * stride);
    for (Index t = 0; t < rows; ++t) tile.segment(t * stride + columns, stride - columns).setConstant(kNaN);
    const Eigen::VectorXd weight = numbers.vector(rows);
    Eigen::VectorXd target(rows * columns + 1);
    target[rows * columns] = 7.0;
    ASSERT_TRUE(kernels_->negated_rows(tile.data(), rows, stride, columns, weight.data(), target.data()));
    for (Index t = 0; t < rows; ++t) {
      for (Index c = 0; c < columns; ++c) {
        ASSERT_EQ(target[t * columns + c], -weight[t] * tile[t * stride + c]) << "row " << t << ", column " << c;
      }
    }
    ASSERT_EQ(target[rows * columns], 7.0) << "wrote beyond the last row";
    ASSERT_TRUE(kernels_->negated_rows(tile.data(), rows, stride, columns, nullptr, target.data()));
    ASSERT_EQ(target[0], -tile[0]);
    tile[2 * stride + columns - 1] = kNaN;
    ASSERT_FALSE(kernels_->negated_rows(tile.data(), rows, stride, columns, nullptr, target.data()));
  }
}

// Rows of a last filter and what they must become. NaN stands wherever no number may be used.
struct LastFilterCase {
  Filter filter;
  Index columns;
  Index rows;
  Index stride;
  Index width;
  Eigen::VectorXd data;
  Eigen::VectorXd states;
  Eigen::VectorXd s;
  Eigen::VectorXd r;
  Eigen::VectorXd target;
  FilterRows job;
  Eigen::MatrixXd expected;

  LastFilterCase(Index order, Index column_count, Index row_count, Index s_count, Index r_count,
                 UniformNumbers& numbers)
      : filter(order, numbers),
        columns(column_count),
        rows(row_count),
        stride(padded(columns) + 8),
        width(columns + s_count + r_count),
        data(Eigen::VectorXd::Constant(1 + rows * stride, kNaN)),
        states(Eigen::VectorXd::Zero(order * padded(columns))),
        s(signal(s_count, numbers)),
        r(signal(r_count, numbers)),
        target(Eigen::VectorXd::Constant(rows * width + 16, 7.0)),
        job{data.data() + 1, rows, stride, columns, {s.data(), s_count}, {r.data(), r_count}, target.data()},
        expected(rows, width) {
    for (Index c = 0; c < columns; ++c) {
      Eigen::VectorXd z = numbers.vector(order);
      for (Index k = 0; k < order; ++k) states[k * padded(columns) + c] = z[k];
      for (Index t = 0; t < rows; ++t) expected(t, c) = -filter.step(data[1 + t * stride + c] = numbers.next(), z);
    }
    for (Index t = 0; t < rows; ++t) {
      for (Index k = 0; k < s_count; ++k) expected(t, columns + k) = -s[rows - 1 - t + k];
      for (Index k = 0; k < r_count; ++k) expected(t, columns + s_count + k) = -r[rows - 1 - t + k];
    }
  }
  LastFilterCase(const LastFilterCase&) = delete;
  LastFilterCase& operator=(const LastFilterCase&) = delete;

  bool run(const Kernels& kernels) {
    return kernels.negated_filter_rows(filter.b.data(), filter.a.data(), filter.order, states.data(), padded(columns),
                                       job);
  }

 private:
  Eigen::VectorXd signal(Index count, UniformNumbers& numbers) const {
    Eigen::VectorXd values = Eigen::VectorXd::Constant(rows + count + kShiftedSignalGuard, kNaN);
    if (count > 0) values.head(rows - 1 + count) = numbers.vector(rows - 1 + count);
    return values;
  }
};

TEST_P(KernelsTest, NegatedFilterRowsFilterShiftAndPack) {
  UniformNumbers numbers(10);
  for (Index order = 1; order <= kMaxUnrolledOrder; ++order) {
    for (const Index columns : {0, 1, 2, 3, 4, 5, 7, 8, 9, 13, 15, 16, 17, 24, 33}) {
      for (const auto& [s_count, r_count] : {std::pair<Index, Index>{1, 0}, {4, 3}, {2, 8}, {9, 1}}) {
        for (const Index rows : {1, 2, 9, 21}) {
          LastFilterCase c(order, columns, rows, s_count, r_count, numbers);
          const Eigen::VectorXd before = c.data;
          ASSERT_TRUE(c.run(*kernels_)) << "order " << order << ", columns " << columns;
          for (Index t = 0; t < rows; ++t) {
            for (Index k = 0; k < c.width; ++k) {
              ASSERT_NEAR(c.target[t * c.width + k], c.expected(t, k), kRounding)
                  << "order " << order << ", columns " << columns << ", row " << t << " of " << rows << ", column "
                  << k;
            }
          }
          ASSERT_TRUE((c.target.tail(16).array() == 7.0).all()) << "wrote behind the last row, columns " << columns;
          ASSERT_TRUE(c.states.allFinite()) << "stale numbers came into the state";
          ASSERT_TRUE((c.data.array() == before.array() || before.array().isNaN()).all()) << "wrote to the tile";
        }
      }
    }
  }
}

TEST_P(KernelsTest, NegatedFilterRowsLeaveTheStateOfFilterColumns) {
  UniformNumbers numbers(11);
  for (Index order = 1; order <= kMaxUnrolledOrder; ++order) {
    for (const Index columns : {1, 8, 13, 33}) {
      LastFilterCase c(order, columns, 9, 2, 1, numbers);
      Eigen::VectorXd states = c.states;
      Eigen::VectorXd tile = c.data;
      kernels_->filter_columns(c.filter.b.data(), c.filter.a.data(), order, states.data(), padded(columns),
                               tile.data() + 1, 9, c.stride, columns);
      ASSERT_TRUE(c.run(*kernels_));
      ASSERT_LE((c.states - states).lpNorm<Eigen::Infinity>(), kRounding) << "order " << order;
    }
  }
}

TEST_P(KernelsTest, NegatedFilterRowsReportWhatIsNotFinite) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  UniformNumbers numbers(12);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (Index order = 1; order <= kMaxUnrolledOrder; ++order) {
      // Without poles a number that is not finite would leave the filter after `order` samples but for 0 * inf.
      for (const bool poles : {true, false}) {
        for (const Index column : {Index{0}, Index{12}, Index{32}}) {
          LastFilterCase c(order, 33, 21, 2, 1, numbers);
          if (!poles) c.filter.a.setZero();
          c.data[1 + 3 * c.stride + column] = bad;
          ASSERT_FALSE(c.run(*kernels_)) << "order " << order << ", column " << column;
        }
      }
    }
    LastFilterCase in_s(3, 5, 21, 4, 3, numbers);
    in_s.s[21 + 4 - 2] = bad;
    EXPECT_FALSE(in_s.run(*kernels_));
    LastFilterCase in_r(3, 5, 21, 4, 3, numbers);
    in_r.r[0] = bad;
    EXPECT_FALSE(in_r.run(*kernels_));
  }
}

TEST_P(KernelsTest, AllFiniteSeesEveryValueAndNoOther) {
  UniformNumbers numbers(13);
  for (Index n = 0; n <= 33; ++n) {
    Eigen::VectorXd values(n + 1);
    values << numbers.vector(n), kNaN;
    ASSERT_TRUE(kernels_->all_finite(values.data(), n));
    for (Index k = 0; k < n; ++k) {
      Eigen::VectorXd bad = values;
      bad[k] = -std::numeric_limits<double>::infinity();
      ASSERT_FALSE(kernels_->all_finite(bad.data(), n)) << "value " << k << " of " << n;
    }
  }
}

TEST_P(KernelsTest, ResidualIsTheDifference) {
  UniformNumbers numbers(14);
  for (Index n = 0; n <= 33; ++n) {
    const Eigen::VectorXd y = numbers.vector(n);
    const Eigen::VectorXd yhat = numbers.vector(n);
    Eigen::VectorXd r = Eigen::VectorXd::Constant(n + 1, 7.0);
    kernels_->residual(y.data(), yhat.data(), r.data(), n);
    ASSERT_EQ(r.head(n), y - yhat);
    ASSERT_EQ(r[n], 7.0) << "wrote behind the last, n " << n;
  }
}

TEST_P(KernelsTest, AddGramAddsToTheUpperTriangleAlone) {
  UniformNumbers numbers(4);
  for (Index columns = 1; columns <= 41; ++columns) {
    const Index width = padded(columns);
    for (const Index rows : {0, 1, 5, 64, 513}) {
      const Index stride = width + 8;
      const Index gram_stride = width + 16;
      Eigen::VectorXd tile = numbers.vector(1 + rows * stride);
      const Eigen::MatrixXd before = Eigen::MatrixXd::NullaryExpr(width, width, [&] { return numbers.next(); });
      Eigen::VectorXd gram = Eigen::VectorXd::Constant(width * gram_stride, kNaN);
      for (Index i = 0; i < width; ++i) {
        for (Index j = 0; j < width; ++j) gram[i * gram_stride + j] = before(i, j);
      }
      kernels_->add_gram(tile.data() + 1, rows, stride, columns, gram.data(), gram_stride);
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      const Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>> data(tile.data() + 1, rows, width,
                                                                     Eigen::OuterStride<>(stride));
      const Eigen::MatrixXd expected = before + data.transpose() * data;
      for (Index i = 0; i < width; ++i) {
        for (Index j = 0; j < gram_stride; ++j) {
          const double got = gram[i * gram_stride + j];
          if (j >= width) {
            ASSERT_TRUE(std::isnan(got)) << "wrote beside row " << i;
          } else if (j / 8 < i / 8) {
            ASSERT_EQ(got, before(i, j)) << "wrote below the diagonal blocks at " << i << ", " << j;
          } else if (j >= i && j < columns) {
            ASSERT_NEAR(got, expected(i, j), 1e-15 * static_cast<double>(10 + rows)) << i << ", " << j;
          }
        }
      }
    }
  }
}

// T_k(x) and its derivative by the three-term recursion in long double.
std::pair<double, double> chebyshev_sum(const Eigen::VectorXd& c, double x) {
  long double value = 0.0L;
  long double slope = 0.0L;
  long double t0 = 1.0L;
  long double t1 = x;
  long double d0 = 0.0L;
  long double d1 = 1.0L;
  for (Index k = 0; k < c.size(); ++k) {
    value += c[k] * t0;
    slope += c[k] * d0;
    const long double t2 = 2.0L * x * t1 - t0;
    const long double d2 = 2.0L * t1 + 2.0L * x * d1 - d0;
    t0 = t1;
    t1 = t2;
    d0 = d1;
    d1 = d2;
  }
  return {static_cast<double>(value), static_cast<double>(slope)};
}

TEST_P(KernelsTest, ChebyshevSumsTheSeries) {
  UniformNumbers numbers(5);
  const double scale = 0.8;
  const double shift = 0.15;
  for (const Index degree : {0, 1, 2, 3, 4, 5, 8, 13, 60}) {
    for (const Index n : {0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17}) {
      const Eigen::VectorXd c = numbers.vector(degree + 1);
      const Eigen::VectorXd u = numbers.vector(n);
      Eigen::VectorXd y = Eigen::VectorXd::Constant(n + 1, kNaN);
      kernels_->chebyshev(c.data(), degree, scale, shift, u.data(), y.data(), n);
      for (Index t = 0; t < n; ++t) {
        // Clenshaw's sum loses up to degree^2 roundings near the ends of the range.
        ASSERT_NEAR(y[t], chebyshev_sum(c, scale * u[t] + shift).first,
                    1e-15 * static_cast<double>((degree + 3) * (degree + 3)))
            << "degree " << degree << ", n " << n << ", t " << t;
      }
      ASSERT_TRUE(std::isnan(y[n])) << "wrote beyond the end";
    }
  }
}

TEST_P(KernelsTest, ChebyshevTangentsAreTheBasisAndTheScaledColumns) {
  UniformNumbers numbers(6);
  const double scale = 0.7;
  const double shift = -0.2;
  const Index n = 139;  // more samples than are worked on at once, and a remainder
  for (const Index degree : {0, 1, 2, 3, 6, 60}) {
    for (const Index upstream : {0, 1, 3, 8, 9}) {
      const Eigen::VectorXd c = numbers.vector(degree + 1);
      const Eigen::VectorXd u = numbers.vector(n);
      const Index stride = padded(upstream + degree + 1);
      const double tolerance = 1e-14 * std::pow(static_cast<double>(degree + 3), 4.0) / 10.0;
      Eigen::VectorXd tile = Eigen::VectorXd::Constant(n * stride, kNaN);
      Eigen::MatrixXd before(n, upstream);
      for (Index t = 0; t < n; ++t) {
        for (Index k = 0; k < upstream; ++k) tile[t * stride + k] = before(t, k) = numbers.next();
      }
      Eigen::VectorXd y(n);
      kernels_->chebyshev_tangents(c.data(), degree, scale, shift, u.data(), y.data(), n, tile.data(), stride,
                                   upstream);
      for (Index t = 0; t < n; ++t) {
        const double x = scale * u[t] + shift;
        const auto [value, slope] = chebyshev_sum(c, x);
        ASSERT_NEAR(y[t], value, tolerance) << "degree " << degree;
        for (Index k = 0; k < upstream; ++k) {
          ASSERT_NEAR(tile[t * stride + k], slope * scale * before(t, k), tolerance) << "degree " << degree;
        }
        for (Index k = 0; k <= degree; ++k) {
          const double basis = chebyshev_sum(Eigen::VectorXd::Unit(degree + 1, k), x).first;
          ASSERT_NEAR(tile[t * stride + upstream + k], basis, tolerance) << "T_" << k;
        }
      }
    }
  }
}

TEST_P(KernelsTest, ScaleRowsLeavesAllBeyondTheNextMultipleOfEightAlone) {
  UniformNumbers numbers(7);
  for (const Index columns : {0, 1, 2, 3, 5, 8, 9, 16, 19}) {
    const Index rows = 6;
    const Index stride = padded(columns) + 8;
    const Eigen::VectorXd slope = numbers.vector(rows);
    const Eigen::VectorXd before = numbers.vector(1 + rows * stride);
    Eigen::VectorXd tile = before;
    kernels_->scale_rows(slope.data(), tile.data() + 1, rows, stride, columns);
    for (Index t = 0; t < rows; ++t) {
      for (Index c = 0; c < stride; ++c) {
        const Index place = 1 + t * stride + c;
        if (c >= columns && c < padded(columns)) continue;
        ASSERT_EQ(tile[place], c < columns ? slope[t] * before[place] : before[place])
            << "columns " << columns << ", row " << t << ", column " << c;
      }
    }
  }
}

TEST_P(KernelsTest, ConvolveSignalIsTheSum) {
  UniformNumbers numbers(11);
  for (const Index n : {0, 1, 7, 30}) {
    for (const Index rows : {0, 1, 3, 8, 31, 32, 33, 70}) {
      const Eigen::VectorXd h = numbers.vector(n + 1);
      const Eigen::VectorXd u = numbers.vector(n + rows);
      Eigen::VectorXd y = Eigen::VectorXd::Constant(rows + 1, kNaN);
      kernels_->convolve_signal(h.data(), n, u.data() + n, y.data(), rows);
      for (Index t = 0; t < rows; ++t) {
        ASSERT_NEAR(y[t], h.dot(u.segment(t, n + 1).reverse()), kRounding) << "n " << n << ", rows " << rows;
      }
      ASSERT_TRUE(std::isnan(y[rows])) << "wrote beyond the end, n " << n << ", rows " << rows;
    }
  }
}

TEST_P(KernelsTest, ConvolveColumnsIsTheSumInEachColumn) {
  UniformNumbers numbers(12);
  for (const Index n : {0, 1, 7, 30}) {
    for (const Index rows : {0, 1, 3, 7, 8, 9, 33}) {
      for (const Index columns : {0, 8, 24}) {
        Eigen::VectorXd h = Eigen::VectorXd::Zero(n + 1 + 2 * kConvolutionGuard);
        h.segment(kConvolutionGuard, n + 1) = numbers.vector(n + 1);
        const Index in_stride = columns + 8;
        const Index out_stride = columns + 16;
        const Eigen::VectorXd input = numbers.vector((n + rows) * in_stride);
        Eigen::VectorXd output = Eigen::VectorXd::Constant((rows + 1) * out_stride, kNaN);
        kernels_->convolve_columns(h.data() + kConvolutionGuard, n, input.data() + n * in_stride, in_stride,
                                   output.data(), out_stride, rows, columns);
        for (Index t = 0; t < rows; ++t) {
          for (Index c = 0; c < columns; ++c) {
            double sum = 0.0;
            for (Index k = 0; k <= n; ++k) sum += h[kConvolutionGuard + k] * input[(n + t - k) * in_stride + c];
            ASSERT_NEAR(output[t * out_stride + c], sum, kRounding) << "n " << n << ", row " << t << ", column " << c;
          }
          ASSERT_TRUE(std::isnan(output[t * out_stride + columns])) << "wrote beyond the columns";
        }
        ASSERT_TRUE(std::isnan(output[rows * out_stride])) << "wrote beyond the rows";
      }
    }
  }
}

TEST_P(KernelsTest, MixRowsWeighsTheSameRowsForEveryOutput) {
  UniformNumbers numbers(13);
  for (Index outputs = 1; outputs <= 8; ++outputs) {
    for (const Index inputs : {0, 1, 2, 15, 30}) {
      for (const Index columns : {0, 1, 7, 8, 9, 16, 19, 24, 33, 40}) {
        const Index stride = padded(columns) + 8;
        const Index target_stride = padded(columns) + 16;
        const Eigen::VectorXd weights = numbers.vector(inputs * outputs);
        const Eigen::VectorXd data = numbers.vector(1 + inputs * stride);
        Eigen::VectorXd target = Eigen::VectorXd::Constant(1 + (outputs + 1) * target_stride, kNaN);
        kernels_->mix_rows(weights.data(), inputs, outputs, data.data() + 1, stride, target.data() + 1, target_stride,
                           columns);
        for (Index r = 0; r <= outputs; ++r) {
          for (Index c = 0; c < target_stride; ++c) {
            const double got = target[1 + r * target_stride + c];
            if (r == outputs || c >= padded(columns)) {
              ASSERT_TRUE(std::isnan(got)) << "wrote to row " << r << ", column " << c << " of " << columns;
            } else if (c < columns) {
              double sum = 0.0;
              for (Index k = 0; k < inputs; ++k) sum += weights[k * outputs + r] * data[1 + k * stride + c];
              ASSERT_NEAR(got, sum, kRounding) << "outputs " << outputs << ", inputs " << inputs << ", column " << c;
            }
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace blockid::detail
