// Pieces of gnuplot scripts.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace blockid::cli {

/// Text as a gnuplot string in single quotes; line breaks become blanks.
std::string quoted(std::string_view text);

/// `$name << EOD ... EOD`: a row for each entry, a column for each vector; non-finite numbers as NaN. All (n,).
std::string data_block(const std::string& name, const std::vector<Eigen::VectorXd>& columns);

/// "Output [V]", or the name alone when there is no unit.
std::string axis_label(const std::string& name, const std::string& unit);

}  // namespace blockid::cli
