#include <blockid/cli/report/script.hpp>

#include <blockid/cli/text_table.hpp>

#include <cmath>

namespace blockid::cli {

std::string plot_text(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    const bool control = static_cast<unsigned char>(c) < ' ';
    result += control ? ' ' : c;
    if (c == '\'') result += c;
  }
  return result + "'";
}

std::string data_block(const std::string& name, const std::vector<Eigen::VectorXd>& columns) {
  constexpr int kDigits = 6;
  std::string text = "$" + name + " << EOD\n";
  const Eigen::Index rows = columns.empty() ? 0 : columns.front().size();
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (const Eigen::VectorXd& column : columns) {
      text += (std::isfinite(column[row]) ? number(column[row], kDigits) : "NaN") + " ";
    }
    text.back() = '\n';
  }
  return text + "EOD\n";
}

std::string axis_label(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

}  // namespace blockid::cli
