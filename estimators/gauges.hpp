// Gauges: directions in parameter space along which the simulation does not change.
#pragma once

#include <blockid/blocks/any_block.hpp>
#include <blockid/blocks/model.hpp>

#include <Eigen/Core>
#include <vector>

namespace blockid {

/// Parameters to hold so that no gain can wander between neighbouring blocks: (k,) indices into theta, ascending.
///
/// A linear block in front of a static block closed under input scaling, behind one closed under output scaling, or in
/// front of another linear block can trade gain with it, also through blocks of fixed slope between the two
/// (saturation, dead zone) whose levels follow: its largest numerator coefficient is held. Branches of a sum are
/// treated each by itself. What is left undetermined (e.g. constants of two branches) shows in the covariance.
///
/// frozen: ascending indices that keep their values anyway. Each that fixes a gain takes the place of one hold.
std::vector<Index> gain_gauges(const AnyBlock& chain, const Eigen::VectorXd& theta,
                               const std::vector<Index>& frozen = {});

/// The same model, simulation unchanged, with every tradable gain fixed by convention: the largest numerator
/// coefficient of each such linear block is +1, its neighbour takes the rest. An initial state follows: those of linear
/// blocks are taken to be in units of their output, as all filters here are.
Model normalise(const Model& model);

}  // namespace blockid
