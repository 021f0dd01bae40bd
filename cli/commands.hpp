// One function a command. Each returns the exit code and throws Error for the caller's mistakes.
#pragma once

#include <blockid/cli/options.hpp>

namespace blockid::cli {

int run_fit(const FitCommand& command);
int run_simulate(const SimulateCommand& command);
int run_validate(const ValidateCommand& command);
int run_closed_loop(const ClosedLoopCommand& command);
int run_bla(const BlaCommand& command);
int run_ct(const CtCommand& command);
int run_frf(const FrfCommand& command);
int run_linear(const LinearCommand& command);
int run_info(const InfoCommand& command);
int run_demo(const DemoCommand& command);
int run_reproduce(const ReproduceCommand& command);

}  // namespace blockid::cli
