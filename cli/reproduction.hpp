// What computing a publication anew brings.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace blockid::cli {

/// One figure of a publication beside ours.
struct ReproducedFigure {
  std::string quantity;
  /// None when the publication shows a picture only.
  std::optional<double> published;
  double reproduced = 0.0;
  /// What has to hold, in words.
  std::string tolerance;
  bool pass = false;
};

/// A picture before gnuplot has drawn it.
struct Picture {
  /// Of its file: STEM.svg.
  std::string stem;
  std::string title;
  /// gnuplot's commands; they set neither terminal nor output.
  std::string script;
  int width = 900;
  int height = 360;
};

struct Reproduction {
  std::vector<ReproducedFigure> figures;
  std::vector<Picture> pictures;
  /// What the print gets wrong or leaves out, a sentence each.
  std::vector<std::string> notes;
};

}  // namespace blockid::cli
