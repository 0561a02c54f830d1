#pragma once

#include <string>
#include <vector>

#include "learner/report/figures/plot.h"
#include "learner/report/figures/policy_plot.h"

namespace treeroll::report {

/// What would be seen, from the poses that a task records: for each condition a strip of what it
/// began with and one of its best policy, instants side by side, in grey what was seen since the
/// instant before. At most four conditions on a page. What the lines stand for is the task's to
/// know.
std::vector<Plot> motion_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

}  // namespace treeroll::report
