// Exhaustive split of the best linear approximation between the two filters.
#pragma once

#include <blockid/estimators/candidate.hpp>

namespace blockid {

struct SplitOptions {
  /// Partitions that are tried; when there are more, an evenly spread selection of that many.
  Index max_partitions = 4096;
  /// Samples of each record that rank the partitions; 0 for all.
  Index ranking_samples = 20000;
  /// Candidates handed on.
  Index keep = 16;
};

/// Every partition of the best linear approximation's pole and zero groups into G_W and G_H of the wanted degrees, the
/// static block by least squares, ranked by the error of simulation.
///
/// For a chain rational(nb1,na1) | f | rational(nb2,na2): BLA of degrees nb1+nb2 and na1+na2 with the delays' sum, then
/// all ways to give na1 poles and nb1 zeros to G_W. A complex pair stays together unless no partition fits; then pairs
/// are broken into real roots, the most damped first. Static blocks that are not linear in their parameters are ranked
/// with a spline in their place and then fitted to that spline's curve. An oversampled static block is ranked in its
/// plain form and put back into what is handed on. Source: Sjoberg and Schoukens 2012.
Initialiser exhaustive_split(SplitOptions options = {});

}  // namespace blockid
