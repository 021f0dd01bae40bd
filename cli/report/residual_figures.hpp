// Pictures of residual tests.
#pragma once

#include <blockid/cli/report/figures.hpp>
#include <blockid/validation/error_spectrum.hpp>
#include <blockid/validation/noise_spectrum.hpp>
#include <blockid/validation/residual_tests.hpp>

#include <string>
#include <vector>

namespace blockid::cli {

/// One picture for each group of tests that could be made, in the order of reading; set: "test" or "training".
std::vector<Figure> residual_figures(const ResidualTests& tests, const std::string& set);

/// Error and noise of a periodic record beside each other.
Figure periodic_error_figure(const PeriodicError& error, const std::string& unit, const std::string& set);

/// Spectrum of the residual and of the record of noise, band by band.
Figure noise_spectrum_figure(const NoiseSpectrumTest& test, const std::string& unit, const std::string& set);

}  // namespace blockid::cli
