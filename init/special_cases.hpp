// Wiener and Hammerstein models as starts of a Wiener-Hammerstein model.
#pragma once

#include <blockid/estimators/candidate.hpp>

namespace blockid {

/// Two candidates: all dynamics in G_W (the best linear approximation of its degrees, G_H = 1), and all in G_H.
/// Empty for a chain that has one filter only.
Initialiser wiener_and_hammerstein();

}  // namespace blockid
