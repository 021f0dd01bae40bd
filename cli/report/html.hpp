// A plain HTML page without external resources.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace blockid::cli {

/// Text with & < > " ' as entities.
std::string escaped(std::string_view text);

/// Grows from top to bottom. Texts are escaped here, SVG is taken as it is.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// A text in a box that stands out.
  void warning(const std::string& text);
  /// Preformatted text, e.g. the chain.
  void code(const std::string& text);
  /// First column of each row as text, the others as numbers.
  void table(const std::vector<std::string>& headers, const std::vector<std::vector<std::string>>& rows);
  /// max_width: of the picture on a wide screen, in pixels.
  void figure(const std::string& id, const std::string& title, const std::string& svg, const std::string& caption,
              int max_width);
  /// The figure's place when there is no picture.
  void missing_figure(const std::string& id, const std::string& title, const std::string& reason);

  /// The whole page.
  std::string text() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace blockid::cli
