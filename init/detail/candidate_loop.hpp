// Candidates made side by side, with progress and cancellation.
#pragma once

#include <blockid/estimators/candidate.hpp>
#include <blockid/estimators/detail/parallel_for.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace blockid::detail {

/// The candidates make(0) .. make(count - 1) in this order, on options.threads threads; make may return nothing.
/// Progress is told after each under the name `stage`; those left when it cancels are missing.
template <class Make>
std::vector<Candidate> candidate_loop(std::size_t count, const std::string& stage, const InitialiserOptions& options,
                                      Make&& make) {
  std::vector<std::optional<Candidate>> made(count);
  std::atomic<bool> cancelled = false;
  std::mutex mutex;
  Index done = 0;
  double best = std::numeric_limits<double>::infinity();
  parallel_for(count, options.threads, [&](std::size_t k) {
    if (cancelled) return;
    made[k] = make(k);
    const std::lock_guard lock(mutex);
    ++done;
    if (made[k]) best = std::min(best, made[k]->rmse);
    if (options.progress && !options.progress({stage, done, static_cast<Index>(count), best, 0.0})) cancelled = true;
  });
  std::vector<Candidate> result;
  for (std::optional<Candidate>& candidate : made) {
    if (candidate) result.push_back(std::move(*candidate));
  }
  return result;
}

}  // namespace blockid::detail
