// Linear systems named on the command line.
#pragma once

#include <blockid/blocks/model.hpp>
#include <blockid/validation/coprime_factors.hpp>

#include <complex>
#include <optional>
#include <string>

namespace blockid::cli {

/// A discrete-time system and, from a model file, its sample time.
struct NamedTransferFunction {
  DiscreteTransferFunction system;
  std::optional<double> sample_time_s = std::nullopt;
};

/// `text` is the name of a model file, FILE.json, whose chain is a row of gain, delay, fir, rational and biquads; or
/// the coefficients of q^-1 of numerator and denominator, "b0,b1,... / a0,a1,...", the denominator 1 when there is
/// none. `option`: for messages. Throws Error for text that is neither, and a chain that is not such a row.
NamedTransferFunction transfer_function(const std::string& option, const std::string& text);

/// The row as one system. Throws Error for other blocks.
DiscreteTransferFunction transfer_function(const Model& model);

/// "(0.1 + 0.2 q^-1) / (1 - 0.9 q^-1)"
std::string to_text(const DiscreteTransferFunction& g);

/// G(e^{j omega}), omega in rad per sample.
std::complex<double> response(const DiscreteTransferFunction& g, double omega);

/// |G(e^{j omega})|
double magnitude(const DiscreteTransferFunction& g, double omega);

}  // namespace blockid::cli
