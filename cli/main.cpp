#include <blockid/cli/program.hpp>

int main(int argc, char** argv) { return blockid::cli::run_program(argc, argv); }
