// How many frequencies a measured input excites, and how many coefficients they can tell.
#pragma once

#include <blockid/blocks/block.hpp>
#include <blockid/data/data_set.hpp>

#include <string>

namespace blockid {

/// Each frequency gives the real and the imaginary part of one value of G, a mean that is not zero gives G(0).
struct Excitation {
  Index frequencies = 0;
  bool mean = false;
  Index equations() const { return 2 * frequencies + (mean ? 1 : 0); }
};

/// Frequencies within the records whose power is above 1e-6 of that of the strongest one of their record, counted once
/// however many records have them. Spectra are taken behind a four-term Blackman-Harris window (Harris 1978; side lobes
/// 6e-10), of which a sinusoid fills 7.2 lines at that level; lines 1 .. w + 7.2 in a row therefore count as 1 + w
/// frequencies. What starts or ends within a record has a wide spectrum, and counts so.
/// The mean, behind the same window, counts from 1e-3 of the root mean square on. Records of fewer than 16 samples
/// excite half as many frequencies as they have samples.
Excitation excitation(const DataSet& data);

/// Empty when the equations are at least as many as the coefficients, otherwise a sentence with the numbers: transients
/// aside, the rest of the coefficients is not determined, however well the model fits.
std::string text_of_lack(const Excitation& excitation, Index coefficients);

}  // namespace blockid
