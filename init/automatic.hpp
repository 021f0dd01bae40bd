// A Wiener-Hammerstein model with its orders, delay, knots and oversampling chosen from the data.
#pragma once

#include <blockid/estimators/fit.hpp>
#include <blockid/init/combined.hpp>

#include <string>
#include <vector>

namespace blockid {

struct AutomaticOptions {
  FitOptions fit = {};
  /// Largest degree of each filter, and largest delay.
  Index max_order = 6;
  Index max_delay = 5;
  /// Last part of each record that is held back to compare structures.
  double validation_share = 0.25;
  /// A structure must lower the validation error by this share to be taken for the one before.
  double improvement = 0.01;
  /// Samples of each record that structures are compared on; the final fit takes all.
  Index samples = 40000;
};

/// One structure that was tried.
struct StructureScore {
  /// Text form of the chain.
  std::string chain;
  double validation_rmse = 0.0;
  Index parameters = 0;
  bool taken = false;
};

struct AutomaticResult {
  /// wall_seconds: of the whole search.
  FitResult fit;
  /// Text form of the chain that was taken.
  std::string chain;
  std::vector<StructureScore> tried = {};
};

/// Grows a chain `rational | spline | rational` while the error on held-back data falls:
///   1. delay: the smallest one that a table of linear models finds as good as any;
///   2. equal degrees n = 1, 2, .. of both filters, started by fractional() without its random stages: a chain too
///      small leaves more than noise from any start;
///   3. knots of the spline 20, 30, 45;
///   4. the spline oversampled by 2, 4, 8, as long as each helps;
///   5. one degree more in either filter, started from the smaller model, until neither helps.
/// Then the chosen chain is fitted to all data, started from the model found.
///
/// Throws Error for records too short to hold back a part (fewer than 100 samples) and for what fit() throws.
/// Cancelled: the best structure so far.
AutomaticResult fit_wiener_hammerstein(const DataSet& data, const AutomaticOptions& options = {});

/// The same with the static block of `chain`, a row `rational | static block | rational` of which either filter may be
/// missing: degrees and delay of its filters are replaced by steps 1, 2 and 5, all else stays as given. `initialiser`
/// starts step 2.
///
/// Throws Error for any other chain, and as above.
AutomaticResult fit_with_chosen_orders(const AnyBlock& chain, const DataSet& data, const AutomaticOptions& options = {},
                                       const Initialiser& initialiser = fractional({.random_stages = 0}));

}  // namespace blockid
