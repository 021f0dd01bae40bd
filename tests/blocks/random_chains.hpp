// Chains drawn at random, and parameters at which they are worth testing.
#pragma once

#include "blocks/custom_blocks.hpp"

#include <blockid/blocks/any_block.hpp>
#include <blockid/testing/block_conformance.hpp>

#include <Eigen/Core>
#include <random>
#include <string>

namespace blockid::testing {

// Denominator coefficients a_1 .. a_na with poles spread over the disc of the given radius, (na,).
Eigen::VectorXd random_denominator(Index na, double radius, UniformNumbers& numbers);

// Parameters for any block: poles of rational filters within a radius of 0.9, all other numbers near their start.
Eigen::VectorXd random_parameters(const AnyBlock& block, UniformNumbers& numbers);

// A block of any kind that stands by itself.
AnyBlock random_leaf(std::mt19937_64& engine);

// A leaf, a row or a sum of one to three blocks, nested to the given depth; labels on some of the blocks only.
AnyBlock random_chain(std::mt19937_64& engine, int depth);

// "[rational + (polynomial | custom)]".
std::string outline(const AnyBlock& block);

}  // namespace blockid::testing
