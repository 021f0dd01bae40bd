// Correlations of signals of which some samples may not count.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace blockid {

/// A signal of one record and the samples of it that count.
struct MaskedSignal {
  Eigen::VectorXd values;  ///< (N,) anything where the mask is 0
  Eigen::VectorXd mask;    ///< (N,) 1 where a sample counts, else 0
};

/// mask_t (x_t - mean), the mean being that of the samples that count in all records; one (N,) a record.
std::vector<Eigen::VectorXd> deviations(std::span<const MaskedSignal> records);

/// products_k = sum d_t d_{t+k} over all records, counts_k = the pairs that count; k = 0..max_lag: (max_lag + 1,) each.
struct PairSums {
  Eigen::VectorXd products;
  Eigen::VectorXd counts;
};
PairSums pair_sums(std::span<const MaskedSignal> records, Eigen::Index max_lag);

/// r_k = products_k / products_0, k = 0..max_lag: (max_lag + 1,). NaN when x does not vary.
Eigen::VectorXd autocorrelation(const Eigen::VectorXd& x, const Eigen::VectorXd& mask, Eigen::Index max_lag);

}  // namespace blockid
