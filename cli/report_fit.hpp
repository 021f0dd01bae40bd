// report.html of a fit.
#pragma once

#include <blockid/cli/fit_outcome.hpp>
#include <blockid/cli/judgement.hpp>

#include <iosfwd>
#include <string>

namespace blockid::cli {

/// The report as one HTML file with its pictures inline. Without gnuplot it says so where pictures would be.
std::string fit_report(const FitOutcome& outcome, const FitJudgement& tests);

/// Tells the user on `stream`, before the work, when there will be no pictures.
void announce_missing_gnuplot(std::ostream& stream);

}  // namespace blockid::cli
