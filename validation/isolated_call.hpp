// Calls of code that prints, reads its working directory or ends the process: in a child process of its own.
#pragma once

#include <functional>
#include <vector>

namespace blockid {

/// The numbers that `call` returns, computed in a forked child.
///
/// The child works in an empty scratch folder, has /dev/null as its standard streams and no other open file but the
/// pipe to its parent, and is killed when time_limit_s has passed. What it changes in memory, the environment or the
/// working directory is lost with it, and neither exit() nor a crash reaches the parent. An exception ends the child
/// without an answer. Only the calling thread is forked: the call must not wait for another one.
/// Throws Error when the child ends without an answer, saying how, and when it is out of time; also for a time limit
/// that is not above 0 and when the system gives no process, pipe or folder.
std::vector<double> call_isolated(const std::function<std::vector<double>()>& call, double time_limit_s);

}  // namespace blockid
