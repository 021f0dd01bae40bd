// Options with a memory of their cancellation.
#pragma once

#include <blockid/estimators/candidate.hpp>

#include <memory>

namespace blockid::detail {

/// `options` whose progress function sets `cancelled` once the caller's has returned false, and then stays at that.
inline InitialiserOptions watched(const InitialiserOptions& options, const std::shared_ptr<bool>& cancelled) {
  InitialiserOptions result = options;
  if (options.progress) {
    result.progress = [progress = options.progress, cancelled](const Progress& p) {
      if (!progress(p)) *cancelled = true;
      return !*cancelled;
    };
  }
  return result;
}

}  // namespace blockid::detail
