// What the program's exit code means.
#pragma once

namespace blockid::cli {

inline constexpr int kSuccess = 0;
/// Unknown options, unreadable or unsuitable data, model text that does not parse.
inline constexpr int kBadInput = 1;
/// The fit diverged, a simulation left the finite numbers, or a published figure was missed. Results that exist are
/// written.
inline constexpr int kNumericalFailure = 2;
/// A result file cannot be written.
inline constexpr int kCannotWrite = 3;
/// A mistake of the program itself.
inline constexpr int kInternalError = 4;
/// The data contradict the model (validate, closed-loop).
inline constexpr int kInvalidated = 5;
/// Neither contradicted nor confirmed (closed-loop).
inline constexpr int kUndecided = 6;
/// Ctrl-C; the best model so far is written.
inline constexpr int kInterrupted = 130;

inline constexpr const char* kExitCodesText =
    "Exit codes: 0 success; 1 bad usage or bad input; 2 numerical failure (the fit diverged or the simulation is not\n"
    "finite; results that exist are written); 3 a result file cannot be written; 4 an error inside the program;\n"
    "5 the data contradict the model and 6 undecided (validate and closed-loop only);\n"
    "130 interrupted by Ctrl-C (the best model so far is written; a second Ctrl-C stops at once).\n";

}  // namespace blockid::cli
