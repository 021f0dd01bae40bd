#include <blockid/validation/masked_correlation.hpp>

#include <algorithm>

namespace blockid {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

}  // namespace

std::vector<VectorXd> deviations(std::span<const MaskedSignal> records) {
  double sum = 0.0;
  double count = 0.0;
  for (const MaskedSignal& record : records) {
    sum += (record.mask.array() > 0.0).select(record.values, 0.0).sum();
    count += record.mask.sum();
  }
  const double mean = sum / std::max(count, 1.0);
  std::vector<VectorXd> result;
  for (const MaskedSignal& record : records) {
    result.emplace_back((record.mask.array() > 0.0).select(record.values.array() - mean, 0.0));
  }
  return result;
}

PairSums pair_sums(std::span<const MaskedSignal> records, Index max_lag) {
  const std::vector<VectorXd> centred = deviations(records);
  PairSums sums{VectorXd::Zero(max_lag + 1), VectorXd::Zero(max_lag + 1)};
  for (std::size_t i = 0; i < records.size(); ++i) {
    const VectorXd& d = centred[i];
    const VectorXd& mask = records[i].mask;
    const Index n = d.size();
    for (Index k = 0; k <= std::min(max_lag, n - 1); ++k) {
      sums.products[k] += d.head(n - k).dot(d.tail(n - k));
      sums.counts[k] += mask.head(n - k).dot(mask.tail(n - k));
    }
  }
  return sums;
}

VectorXd autocorrelation(const VectorXd& x, const VectorXd& mask, Index max_lag) {
  const MaskedSignal signal{x, mask};
  const VectorXd products = pair_sums({&signal, 1}, max_lag).products;
  return products / products[0];
}

}  // namespace blockid
