// CSDP as another solver of semidefinite programmes, kept apart from the process that asks it.
#pragma once

#include <blockid/validation/uncertainty_programme.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// One entry of a symmetric matrix, row <= column, both from zero; in a diagonal block row = column.
struct SemidefiniteEntry {
  Eigen::Index block = 0;
  Eigen::Index row = 0;
  Eigen::Index column = 0;
  double value = 0.0;
};

struct SemidefiniteBlock {
  Eigen::Index size = 0;
  bool diagonal = false;
};

/// min cost'y such that y_1 A_1 + ... + y_m A_m - C is positive semidefinite, block by block.
struct SemidefiniteProgramme {
  std::vector<SemidefiniteBlock> blocks;
  Eigen::VectorXd cost;                                  ///< (m,)
  std::vector<SemidefiniteEntry> constant;               ///< C; no entry twice
  std::vector<std::vector<SemidefiniteEntry>> matrices;  ///< A_1..A_m
};

/// alpha*(gamma) = min alpha such that alpha I + K(h) and alpha I - K(h) are positive semidefinite, |w - A h| <= gamma;
/// y = (h_0..h_{n-1}, alpha). Throws Error unless gamma >= 0 and the sizes agree.
SemidefiniteProgramme hankel_form(const UncertaintyProgramme& programme, double gamma);

struct CsdpSolution {
  int code = 0;  ///< CSDP's own: 0 solved, 1 and 2 infeasible, 3 solved to less accuracy, above: failed
  double primal = 0.0;
  double dual = 0.0;  ///< cost'y
  Eigen::VectorXd y;  ///< (m,)
};

/// Whether blockid was built with CSDP's header and its library (Debian: libsdp-dev, libsdp0) can be loaded.
bool csdp_available();

/// Solves by CSDP 6.2 with its default parameters, in one thread.
///
/// CSDP ends its process when it runs out of memory, prints, and reads `param.csdp` from the working directory. It is
/// therefore loaded by a child process only, which works in an empty scratch folder, has no open file but the pipe to
/// its parent, and is ended at the time limit. The child is a fork: do not call while other threads hold locks of their
/// own that CSDP could need.
/// Throws Error when csdp_available() is false, for a programme whose indices, sizes or values do not fit, for a time
/// limit of zero or less, and when the child ends without an answer or is out of time.
/// Source: B. Borchers, "CSDP, a C library for semidefinite programming", Optimization Methods and Software 11, 1999.
CsdpSolution solve_with_csdp(const SemidefiniteProgramme& programme, double time_limit_s = 600.0);

}  // namespace blockid
