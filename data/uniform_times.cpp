#include <blockid/data/uniform_times.hpp>

#include <blockid/data/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Stamps = Eigen::Ref<const VectorXd>;

/// Roundings finer than this part of an interval are hidden in the jitter.
constexpr double kFinestStamp = 1e-3;

void check_increase(const Stamps& times, std::string_view name) {
  if (times.size() < 2) fail("time stamps '", name, "': expected two or more, came ", times.size());
  for (Index k = 0; k < times.size(); ++k) {
    if (!std::isfinite(times[k])) fail("time stamp '", name, "' at sample index ", k, " is ", times[k]);
    if (k == 0 || times[k] > times[k - 1]) continue;
    fail("time stamps '", name, "' do not increase: ", times[k - 1], " s at sample index ", k - 1, ", ", times[k],
         " s at ", k,
         "; stamps that are rounded to a whole interval or more say no sample time, give the rate instead");
  }
}

double median_interval(const Stamps& times) {
  const Index count = times.size() - 1;
  VectorXd intervals = times.tail(count) - times.head(count);
  double* const middle = intervals.data() + count / 2;
  std::nth_element(intervals.data(), middle, intervals.data() + count);
  return *middle;
}

bool multiples_of(double quantum, const Stamps& times) {
  constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();
  constexpr double kSlack = 1e-6;
  return (times.array() / quantum)
             .unaryExpr([](double ratio) { return std::abs(ratio - std::round(ratio)) - kRounding * std::abs(ratio); })
             .maxCoeff() <= kSlack;
}

double decimal_resolution(const Stamps& times, double interval) {
  constexpr double kTen = 10.0;
  for (double exponent = std::ceil(std::log10(interval)); std::pow(kTen, exponent) >= kFinestStamp * interval;
       exponent -= 1.0) {
    const double quantum = std::pow(kTen, exponent);
    if (multiples_of(quantum, times)) return quantum;
  }
  return 0.0;
}

/// Spacing of the binary numbers around the largest stamp.
double binary_resolution(const Stamps& times) {
  const double largest = times.cwiseAbs().maxCoeff();
  const bool single = (times.array() == times.cast<float>().cast<double>().array()).all();
  return largest * (single ? double{std::numeric_limits<float>::epsilon()} : std::numeric_limits<double>::epsilon());
}

double resolution(const Stamps& times, double interval) {
  const double result = std::max(decimal_resolution(times, interval), binary_resolution(times));
  return result >= kFinestStamp * interval ? result : 0.0;
}

[[noreturn]] void fail_uneven(std::string_view name, Index from, Index to, double found, double expected, double q) {
  const std::string rounding = q > 0.0 ? compose("; the stamps are rounded to ", q, " s") : std::string();
  fail("time stamps '", name, "' are not uniform: sample index ", to, " comes ", found, " s after sample index ", from,
       ", expected ", expected, " s", rounding,
       ". Resample the record to a uniform grid, or cut it where samples are missing");
}

void check_stride(const Stamps& times, Index stride, double interval, double q, std::string_view name) {
  const double expected = static_cast<double>(stride) * interval;
  const double allowed = kSampleTimeJitter * expected + std::min(q, kCoarsestStamp * interval);
  const double rounding = 2.0 * std::numeric_limits<double>::epsilon() * times.cwiseAbs().maxCoeff();
  for (Index k = stride; k < times.size(); ++k) {
    const double found = times[k] - times[k - stride];
    if (std::abs(found - expected) > allowed + rounding) fail_uneven(name, k - stride, k, found, expected, q);
  }
}

}  // namespace

SampleTimes uniform_times(const Stamps& times_s, std::string_view name) {
  check_increase(times_s, name);
  const Index last = times_s.size() - 1;
  const double median = median_interval(times_s);
  const double q = resolution(times_s, median);
  check_stride(times_s, 1, median, q, name);
  const double mean = (times_s[last] - times_s[0]) / static_cast<double>(last);
  constexpr Index kNextStride = 10;
  for (Index stride = kNextStride; stride <= last; stride *= kNextStride) {
    check_stride(times_s, stride, mean, q, name);
  }
  return {mean, q};
}

void check_sample_time(const SampleTimes& times, Index count, double given_s, std::string_view name) {
  const double q = std::min(times.resolution_s, kCoarsestStamp * times.sample_time_s);
  const double allowed = kClockTolerance * given_s + q / static_cast<double>(count - 1);
  if (std::abs(times.sample_time_s - given_s) <= allowed) return;
  fail("the time stamps '", name, "' are ", times.sample_time_s, " s apart, expected ", given_s, " s");
}

}  // namespace blockid
