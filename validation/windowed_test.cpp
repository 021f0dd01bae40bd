#include <blockid/validation/windowed_test.hpp>

#include <blockid/data/error.hpp>

#include <algorithm>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

void check_plan(const WindowPlan& plan, Index size) {
  if (plan.count < 1 || plan.step < 1) {
    fail("windowed test: expected windows and steps of at least 1 sample, got ", plan.count, " and ", plan.step);
  }
  if (plan.past < -1) fail("windowed test: expected a past of at least 0 samples, or -1 for all, got ", plan.past);
  const Index longest_past = plan.longest - plan.count;
  if (longest_past < 0 || plan.past > longest_past) {
    fail("windowed test: expected a window and its past within ", plan.longest, " samples, got ", plan.count, " and ",
         std::max<Index>(plan.past, 0));
  }
  if (size < plan.count) fail("windowed test: expected at least ", plan.count, " samples, got ", size);
}

UncertaintyVerdict without_matrices(UncertaintyVerdict verdict) {
  verdict.h.resize(0);
  verdict.certificate = {};
  return verdict;
}

}  // namespace

std::vector<WindowedVerdict> windowed_test(const VectorXd& v, const VectorXd& w, double noise_bound,
                                           const WindowPlan& plan, const VerdictOptions& options,
                                           const VectorXd& shape) {
  check_plan(plan, w.size());
  const Index past = plan.past < 0 ? plan.longest - plan.count : plan.past;
  std::vector<WindowedVerdict> rows;
  for (Index first = 0; first + plan.count <= w.size(); first += plan.step) {
    WindowedVerdict row;
    row.first = first;
    row.past = std::min(first, past);
    row.window =
        without_matrices(judge_uncertainty(cut_window(v, w, first, plan.count, row.past, shape), noise_bound, options));
    const Index until = first + plan.count;
    if (first == 0) {
      row.record = row.window;
    } else if (until <= plan.longest) {
      row.record = without_matrices(judge_uncertainty(cut_window(v, w, 0, until, 0, shape), noise_bound, options));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace blockid
