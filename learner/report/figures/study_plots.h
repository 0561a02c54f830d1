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
/// conditions' names, and the mean over them; p-values of the differences at every part; where
/// layers were left; growth of noise, where it is known.
Figures study_plots(const StudyResults& study, const NoiseLevels& noise = {});

/// Mean reward over roll-outs with its 95 % interval over repetitions, a panel a group.
/// Precondition: groups that are not empty.
Plot learning_curves(const StudyResults& study, const Rows<ConditionGroup>& groups);

/// The same for the exploration noise, on a logarithmic axis. Nothing to draw (no commands) without
/// levels for these groups. Precondition: groups that are not empty.
Plot noise_growth(const StudyResults& study, const Rows<ConditionGroup>& groups,
                  const NoiseLevels& noise);

/// The mean over all roll-outs, each condition with its interval and its runs. Precondition: the
/// study has conditions.
Plot average_rewards(const StudyResults& study);

/// Which of two conditions is ahead at each roll-out, and how surely: Welch's one-sided t-test, for
/// every two conditions that differ at `place` of their names alone (group()). Groups of which a
/// condition has one run are left out.
Figures p_values(const StudyResults& study, std::size_t place);

/// Roll-outs before the first switch, a box a condition. Nothing to draw without a switch.
Plot switch_boxes(const StudyResults& study);

/// "a, b, c and 4 more".
std::string listed(const std::vector<std::string>& names);

}  // namespace treeroll::report
