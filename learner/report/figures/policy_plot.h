#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "learner/report/figures/plot.h"
#include "learner/report/figures/shown_trace.h"

namespace treeroll::report {

/// What a condition began with, and the best it has come to.
struct LearntPolicy {
  std::string condition;
  PolicyPtr start;
  PolicyPtr best = {};  ///< of the best roll-out of all repetitions; null: none
  std::optional<ShownRollout> start_rollout = {};  ///< of `start`, if a worker executable made it
  std::optional<ShownRollout> best_rollout = {};   ///< of `best`
};

/// Before and after learning, a panel a condition, at most twelve on a page, a page or more an
/// output: the output that regression gives over the input, the Gaussians of every layer as
/// ellipses of two standard deviations, the start in grey, and the goal that the task's trace has
/// for the output. Policies of several inputs are left out.
std::vector<Plot> policy_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

/// The same for policies of two outputs, one over the other: the path in the plane.
std::vector<Plot> path_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

/// What columns of the trace came to that have a goal (goal_NAME) and are no output of the policy:
/// goal, start and best, a panel a condition.
std::vector<Plot> goal_plots(const std::string& study, const std::vector<LearntPolicy>& policies);

/// The conditions whose policies have several inputs.
std::vector<std::string> not_drawn(const std::vector<LearntPolicy>& policies);

}  // namespace treeroll::report
