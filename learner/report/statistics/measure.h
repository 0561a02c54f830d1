#pragma once

#include <optional>
#include <string>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll::report {

/// A figure of one run: what a claim is about.
enum class MeasureKind {
  kNear,           ///< mean reward of the five roll-outs up to `rollout`
  kMean,           ///< mean reward of roll-outs `from` to `rollout`
  kBest,           ///< best reward of the first `rollout`
  kFinal,          ///< reward of the final mean policy, outside the budget
  kSwitch,         ///< roll-outs before the first switch; of a run that never switched, its budget
  kBeforeSwitch,   ///< mean reward of the five roll-outs up to the first switch
  kAfterSwitch,    ///< mean reward of the five roll-outs after it
  kDrop,           ///< the reward before the switch less the one after it
  kGain,           ///< reward near `rollout` less that of the first five roll-outs
  kSteepest,       ///< largest gain within 50 roll-outs, up to `rollout`
  kLogLikelihood,  ///< StudyResults::log_likelihoods: of the start that all runs of a condition
                   ///< share
};

struct Measure {
  MeasureKind kind = MeasureKind::kNear;
  int from = 1;     ///< roll-outs count from 1 here, as in the thesis's text
  int rollout = 0;  ///< 0: the last of each run
};

/// Nothing where a run lacks it: it was stopped before, never switched, has no final policy; and
/// for kLogLikelihood, which is no run's (see find_sample).
/// A failed roll-out counts with its reward, which is 0.
std::optional<double> measure(const RunRecord& run, const Measure& measure);

/// In words: "reward near roll-out 50".
std::string describe(const Measure& measure);

}  // namespace treeroll::report
