#pragma once

#include <optional>
#include <string>
#include <vector>

#include "learner/core/run_record.h"
#include "learner/results/study_results.h"

namespace treeroll::report {

/// A run as it is compared with others. One that has ended before its budget because it was done,
/// by exploration.stop_at_reward or stop_on_convergence, goes on to the end of its budget with the
/// reward that it ended with. Else what stands at a later roll-out would be of the others alone.
class MeasuredRun {
 public:
  /// Precondition: `record` outlives it.
  /// @param ending  without a budget the run is as long as its record
  MeasuredRun(const RunRecord& record, const RunEnding& ending);

  const RunRecord* operator->() const { return record_; }
  const RunRecord& operator*() const { return *record_; }

  bool goes_on() const { return last_.has_value(); }
  /// By itself, so that nothing more comes of it.
  bool has_ended() const {
    return goes_on() || num_recorded() >= budget_ || record_->final_reward.has_value();
  }
  /// With those that it goes on for.
  int num_rollouts() const { return goes_on() ? budget_ : num_recorded(); }
  int budget() const { return budget_; }
  /// Of a roll-out, counted from 0: nothing past the last, or in a gap.
  std::optional<double> reward(int rollout) const;

 private:
  int num_recorded() const { return static_cast<int>(record_->rollouts.size()); }

  const RunRecord* record_;
  int budget_;
  std::optional<double> last_;  ///< that it goes on with
};

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
  int rollout = 0;  ///< 0: the last of each run, with those that it goes on for

  bool operator==(const Measure&) const = default;
};

/// Nothing where a run lacks it: it was stopped before, never switched, has no final policy; and
/// for kLogLikelihood, which is no run's (see find_sample).
/// A failed roll-out counts with its reward, which is 0.
std::optional<double> measure(const MeasuredRun& run, const Measure& measure);

/// In words: "reward near roll-out 50".
std::string describe(const Measure& measure);

}  // namespace treeroll::report
