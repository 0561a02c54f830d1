#pragma once

#include <map>
#include <string>
#include <vector>

#include "learner/report/figures/condition_grid.h"
#include "learner/report/figures/plot.h"
#include "learner/results/study_results.h"

namespace treeroll::report {

/// Figures, and in sentences what was left out of them.
struct Figures {
  std::vector<Plot> plots;
  std::vector<std::string> left_out = {};
};

/// Exploration noise by condition, repetition (from the first on) and roll-out, in units of the
/// noise deviations: positive.
using NoiseLevels = std::map<std::string, std::vector<std::vector<double>>>;

/// What a study's results look like: curves of learning, by each of the last two parts of the
/// conditions' names; growth of noise, where it is known; p-values of the differences in a group;
/// where layers were left.
Figures study_plots(const StudyResults& study, const NoiseLevels& noise = {});

/// Mean reward over roll-outs with its 95 % interval over repetitions, a panel a group.
/// Precondition: groups that are not empty.
Plot learning_curves(const StudyResults& study, const std::vector<ConditionGroup>& groups);

/// The same for the exploration noise, on a logarithmic axis. Nothing to draw (no commands) without
/// levels for these groups. Precondition: groups that are not empty.
Plot noise_growth(const StudyResults& study, const std::vector<ConditionGroup>& groups,
                  const NoiseLevels& noise);

/// Which of two conditions is ahead at each roll-out, and how surely: Welch's one-sided t-test, for
/// every pair of a group of two to four conditions with two runs each; other groups of several
/// conditions are left out.
Figures p_values(const StudyResults& study, const std::vector<ConditionGroup>& groups);

/// Roll-outs before the first switch, a box a condition. Nothing to draw without a switch.
Plot switch_boxes(const StudyResults& study);

/// "a, b, c and 4 more".
std::string listed(const std::vector<std::string>& names);

}  // namespace treeroll::report
