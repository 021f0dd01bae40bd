// Pieces of gnuplot scripts.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace blockid::cli {

/// Colours that differ in print and for most kinds of colour blindness.
inline constexpr const char* kFigureStyles = R"(
set style line 1 lc rgb '#111827' lw 1.6
set style line 2 lc rgb '#2563eb' lw 1.4
set style line 3 lc rgb '#dc2626' lw 1.1
set style line 4 lc rgb '#9ca3af' lw 1 dt 2
set style line 9 lc rgb '#e5e7eb' lw 1
set border 3 lc rgb '#6b7280'
set grid ls 9
set tics nomirror out scale 0.6 textcolor rgb '#374151'
set key outside top right horizontal samplen 2 textcolor rgb '#374151'
set lmargin 11
)";

/// Text as a gnuplot string in single quotes; line breaks become blanks.
std::string plot_text(std::string_view text);

/// `$name << EOD ... EOD`: a row for each entry, a column for each vector; non-finite numbers as NaN. All (n,).
std::string data_block(const std::string& name, const std::vector<Eigen::VectorXd>& columns);

/// "Output [V]", or the name alone when there is no unit.
std::string axis_label(const std::string& name, const std::string& unit);

}  // namespace blockid::cli
