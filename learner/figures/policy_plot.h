#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "learner/figures/plot.h"

namespace treeroll {

/// What a condition began with, and the best it has come to.
struct LearntPolicy {
  std::string condition;
  TreeModel start;
  std::optional<Policy> best;  ///< of the best roll-out of all repetitions
};

/// The policies of at most twelve conditions, a panel each, as figures 3-1 and 4-17 of the thesis
/// draw them: the output that regression gives over the input, and the Gaussians of every layer as
/// ellipses of two standard deviations; the start in grey. Of several outputs the first. Nothing
/// to draw (no commands) for more than one input.
Plot policy_plot(const std::string& study, const std::vector<LearntPolicy>& policies);

}  // namespace treeroll
