#pragma once

#include <string>
#include <vector>

#include "learner/report/figures/learnt_policy.h"
#include "learner/report/figures/plot.h"

namespace treeroll::report {

/// Before and after learning, a panel a condition, at most twelve on a page, a page or more an
/// output: the output that regression gives over the input, the Gaussians of every layer as
/// ellipses of two standard deviations, the start in grey, and the goal that the task's trace has
/// for the output. Policies of several inputs are slice_plots().
std::vector<Plot> policy_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

/// The same for policies of two outputs, one over the other to one scale: the path in the plane.
std::vector<Plot> path_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

/// The solutions of all repetitions over the goal, as figures 4-10 and 4-15 of the thesis draw
/// them: a panel a condition, a page or more an output, and for two outputs the paths. Policies of
/// several inputs are left out.
std::vector<Plot> solution_plots(const std::string& study,
                                 const std::vector<LearntPolicy>& policies);

/// Policies of several inputs before and after learning, as slices: each output over each input,
/// the other inputs held. A row of panels a condition, a page or more an output.
std::vector<Plot> slice_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

/// What columns of the trace came to that have a goal (goal_NAME) and are no output of the policy:
/// goal, start and best, a panel a condition.
std::vector<Plot> goal_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

}  // namespace treeroll::report
