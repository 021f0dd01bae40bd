#pragma once

#include <Eigen/Core>
#include <string>

namespace blockid {

/// One measured record: N samples of an input u and an output y taken at t_k = k sample_time_s, k =
/// 0..N-1.
///
/// Weights multiply residuals, r_k = w_k (y_k - yhat_k); weight 0 marks a missing output sample,
/// whose y_k may be NaN. The input must be known at every sample because filters remember it.
struct Record {
  std::string name;            ///< for messages and reports; may be empty
  Eigen::VectorXd u;           ///< (N,) input
  Eigen::VectorXd y;           ///< (N,) output
  double sample_time_s = 1.0;  ///< > 0, in seconds
  Eigen::VectorXd weights;     ///< (N,) each >= 0, or empty: all ones
  std::string input_name = "u";
  std::string output_name = "y";
  std::string input_unit;
  std::string output_unit;
  Eigen::Index period = 0;  ///< samples in one period of the input, 0 when aperiodic
};

/// Number of samples N (of the input).
[[nodiscard]] Eigen::Index sample_count(const Record& record);

/// Weight of sample t: 1 when the record carries no weights.
[[nodiscard]] double weight(const Record& record, Eigen::Index t);

/// True when the output sample t is missing, i.e. its weight is 0.
[[nodiscard]] bool is_missing(const Record& record, Eigen::Index t);

/// Number of output samples that are not missing.
[[nodiscard]] Eigen::Index present_count(const Record& record);

/// "record 'name'", or "record" when it has no name: the beginning of every message about a record.
[[nodiscard]] std::string describe(const Record& record);

/// Verifies every promise of Record.
/// @throws Error for an empty record, unequal lengths, a non-finite input sample or present output
/// sample (with its
///   zero-based index), a negative or non-finite weight (with its index), a sample time that is not
///   positive and finite, a period below 0 or above N.
void check(const Record& record);

/// Samples begin..end-1 (zero-based, half-open) with everything else kept; the name gains
/// "[begin:end)". A period longer than the slice becomes 0, since the slice no longer shows it.
/// @throws Error unless 0 <= begin < end <= N.
[[nodiscard]] Record slice(const Record& record, Eigen::Index begin, Eigen::Index end);

/// Verifies that the input excites anything at all.
/// @throws Error when all input samples are equal (the value is in the message).
void check_excitation(const Record& record);

/// Verifies that the present output samples are at least as many as the parameters.
/// @throws Error "fewer samples than parameters" with both numbers.
void check_sample_count(const Record& record, Eigen::Index parameter_count);

}  // namespace blockid
