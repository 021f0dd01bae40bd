// Pictures by the program gnuplot.
#pragma once

#include <string>

namespace blockid::cli {

/// What users should read when there are no pictures.
inline constexpr const char* kGnuplotMissing =
    "gnuplot is not installed (or not on the PATH), so the report has no pictures; on Debian: apt install gnuplot-nox";

/// Whether gnuplot can be started.
bool gnuplot_is_there();

/// The SVG picture that a gnuplot script draws; the script sets neither terminal nor output.
/// The text is fit to stand within an HTML page: no XML prologue, no name spaces, all ids begin with `id`.
/// Throws Error with gnuplot's message when it fails.
std::string gnuplot_svg(const std::string& script, const std::string& id, int width, int height);

/// The same as a document of its own, with XML prologue, name spaces and title.
std::string gnuplot_document(const std::string& script, const std::string& title, int width, int height);

/// SVG text of gnuplot made fit for HTML, as above.
std::string inline_svg(const std::string& svg, const std::string& id);

/// SVG text of gnuplot as a document that names no other, with this title.
std::string document_svg(const std::string& svg, const std::string& title);

}  // namespace blockid::cli
