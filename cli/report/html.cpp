#include <blockid/cli/report/html.hpp>

#include <utility>

namespace blockid::cli {
namespace {

constexpr const char* kStyle = R"(
body { margin: 0 auto; max-width: 62rem; padding: 1.5rem 1.25rem 4rem; color: #1f2937; background: #fff;
       font: 15px/1.5 system-ui, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 .5rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; padding-bottom: .2rem; border-bottom: 1px solid #e5e7eb; }
p { margin: .4rem 0; }
pre { background: #f3f4f6; padding: .6rem .8rem; border-radius: 4px; white-space: pre-wrap; overflow-wrap: anywhere;
      font: 13px/1.45 ui-monospace, "DejaVu Sans Mono", monospace; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .7rem; text-align: right; border-bottom: 1px solid #e5e7eb; white-space: nowrap; }
th { font-weight: 600; color: #4b5563; }
th.text, td.text { text-align: left; white-space: normal; }
figure { margin: 1.2rem 0 1.8rem; }
figure svg { width: 100%; height: auto; display: block; }
figure h3 { font-size: 1rem; margin: 0 0 .3rem; }
figcaption { color: #4b5563; font-size: 13.5px; }
.warning { background: #fff7ed; border-left: 4px solid #f97316; padding: .4rem .8rem; margin: .5rem 0; }
@media print { body { max-width: none; } figure { break-inside: avoid; } }
)";

/// A cell counts as text unless it begins like a number or is a dash.
bool is_text(const std::string& cell) {
  if (cell.empty()) return false;
  const std::size_t first = cell[0] == '-' || cell[0] == '+' ? 1 : 0;
  return cell != "-" && cell != "nan" && cell != "inf" &&
         !(first < cell.size() && cell[first] >= '0' && cell[first] <= '9');
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

HtmlPage::HtmlPage(std::string title) : title_(std::move(title)) {}

void HtmlPage::heading(const std::string& text) { body_ += "<h2>" + escaped(text) + "</h2>\n"; }

void HtmlPage::paragraph(const std::string& text) { body_ += "<p>" + escaped(text) + "</p>\n"; }

void HtmlPage::warning(const std::string& text) { body_ += "<div class=\"warning\">" + escaped(text) + "</div>\n"; }

void HtmlPage::code(const std::string& text) { body_ += "<pre>" + escaped(text) + "</pre>\n"; }

void HtmlPage::table(const std::vector<std::string>& headers, const std::vector<std::vector<std::string>>& rows) {
  std::vector<bool> text_column(headers.size(), false);
  for (const std::vector<std::string>& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) text_column[k] = text_column[k] || is_text(row[k]);
  }
  const auto add_row = [&](const std::vector<std::string>& row, const std::string& tag) {
    body_ += "<tr>";
    for (std::size_t k = 0; k < row.size(); ++k) {
      body_ += "<" + tag + (text_column[k] || k == 0 ? " class=\"text\">" : ">") + escaped(row[k]) + "</" + tag + ">";
    }
    body_ += "</tr>\n";
  };
  body_ += "<div class=\"scroll\"><table>\n<thead>";
  add_row(headers, "th");
  body_ += "</thead>\n<tbody>\n";
  for (const std::vector<std::string>& row : rows) add_row(row, "td");
  body_ += "</tbody></table></div>\n";
}

void HtmlPage::figure(const std::string& id, const std::string& title, const std::string& svg,
                      const std::string& caption, int max_width) {
  body_ += "<figure id=\"" + escaped(id) + "\">\n<h3>" + escaped(title) +
           "</h3>\n<div style=\"max-width:" + std::to_string(max_width) + "px\">" + svg + "</div>\n<figcaption>" +
           escaped(caption) + "</figcaption>\n</figure>\n";
}

void HtmlPage::missing_figure(const std::string& id, const std::string& title, const std::string& reason) {
  body_ += "<figure id=\"" + escaped(id) + "\">\n<h3>" + escaped(title) + "</h3>\n<figcaption>" + escaped(reason) +
           "</figcaption>\n</figure>\n";
}

std::string HtmlPage::text() const {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         escaped(title_) + "</title>\n<style>" + kStyle + "</style>\n</head>\n<body>\n<h1>" + escaped(title_) +
         "</h1>\n" + body_ + "</body>\n</html>\n";
}

}  // namespace blockid::cli
