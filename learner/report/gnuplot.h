#pragma once

#include <filesystem>

#include "learner/report/document.h"
#include "learner/report/figures/plot.h"

namespace treeroll::report {

/// Draws a plot with gnuplot: ID.dat, ID.gp, ID.svg, ID.png (300 dots an inch) and ID.pdf in
/// `folder`, which must exist. The same plot gives the same bytes. Throws std::runtime_error if
/// gnuplot is missing (it names the package) or complains.
/// @param place  where `folder` lies from the document's own folder
Picture draw(const Plot& plot, const std::filesystem::path& folder, const std::string& place);

}  // namespace treeroll::report
