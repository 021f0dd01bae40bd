// Measured public records as problems. They are not part of the repository.
#pragma once

#include <blockid/problems/problem.hpp>

#include <filesystem>

namespace blockid::problems {

/// Folder of the measured records: $BLOCKID_DATA_DIR, otherwise `shared/data` in the working directory or the nearest
/// of its parents that has one, otherwise `../shared/data`. It need not exist.
std::filesystem::path data_folder();

// Each throws Error naming the file that was expected when it is not in `folder`. Ranges are zero-based and half-open.

/// SYSID'09 Wiener-Hammerstein circuit: train [5200, 105200), test [105200, 184000) without the first 50; mV.
/// Source: Schoukens, Suykens, Ljung 2009.
Problem wiener_hammerstein_2009(const std::filesystem::path& folder = data_folder());

/// Wiener-Hammerstein circuit with process noise: train on the ten realisations of the example file; test without
/// process noise, the multisine and the swept sine as two records; mV. Each is one period in steady state.
///
/// The input is the reference r, free of noise. The acquisition, measured input u and output y alike, starts one sample
/// later in eight of the ten realisations than in the other two and the test: u runs 10.27 samples ahead of r there,
/// 11.27 elsewhere. Their r is moved by that one sample, so that one delay holds in all records. Source: Schoukens,
/// Noel 2016.
Problem wiener_hammerstein_process_noise(const std::filesystem::path& folder = data_folder());

/// Heat exchanger, flow to temperature: train [0, 3000), test [3000, 4000) without the first 50; degree Celsius.
/// Source: Bittanti, Piroddi 1997; DaISy.
Problem heat_exchanger(const std::filesystem::path& folder = data_folder());

/// Two tanks with overflow: 1024 samples each, without the first 50; V. Source: Schoukens, Noel 2017.
Problem cascaded_tanks(const std::filesystem::path& folder = data_folder());

/// Silverbox: train on three quarters of the multisines [40650, 105712), test on the arrow [100, 40575) without the
/// first 50; mV. Source: Wigren, Schoukens 2013.
Problem silverbox(const std::filesystem::path& folder = data_folder());

/// Flexible robot arm, torque to tangential acceleration, under a multisine on the odd lines 1..199 of its period:
/// train on the fifth period, test on the seventh, both in steady state; 4096 samples each at 500 Hz. Source: Kollar,
/// Pintelon, Schoukens 1994; the periods are those of Garnier, Goodwin, Welsh 2004, section 6.
Problem robot_arm(const std::filesystem::path& folder = data_folder());

}  // namespace blockid::problems
