#pragma once

#include <vector>

#include "learner/figures/condition_grid.h"
#include "learner/figures/plot.h"
#include "learner/report/study_results.h"

namespace treeroll {

/// What a study's results look like: curves of learning, by each of the last two parts of the
/// conditions' names; p-values of the differences in a group; where layers were left.
std::vector<Plot> study_plots(const StudyResults& study);

/// Mean reward over roll-outs with its 95 % interval over repetitions, a panel a group.
/// Precondition: groups that are not empty.
Plot learning_curves(const StudyResults& study, const std::vector<ConditionGroup>& groups);

/// Which of two conditions is ahead at each roll-out, and how surely: Welch's one-sided t-test, for
/// every pair of a group. Nothing to draw (no commands) if no group has two to four conditions with
/// two runs each.
Plot p_values(const StudyResults& study, const std::vector<ConditionGroup>& groups);

/// Roll-outs before the first switch, a box a condition. Nothing to draw without a switch.
Plot switch_boxes(const StudyResults& study);

}  // namespace treeroll
