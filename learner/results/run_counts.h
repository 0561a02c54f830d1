#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll {

/// In arrival order a record may have gaps: layers count from 1, so layer 0 is "no result yet".
inline bool is_applied(const RolloutRecord& rollout) { return rollout.layer > 0; }

inline std::int64_t num_applied(const RunRecord& run) {
  return std::count_if(run.rollouts.begin(), run.rollouts.end(), is_applied);
}

inline std::int64_t num_failed(const RunRecord& run) {
  return std::count_if(run.rollouts.begin(), run.rollouts.end(), [](const RolloutRecord& rollout) {
    return is_applied(rollout) && rollout.status != RolloutStatus::kOk;
  });
}

inline std::int64_t num_with(const RunRecord& run, RolloutStatus status) {
  return std::count_if(run.rollouts.begin(), run.rollouts.end(),
                       [status](const RolloutRecord& rollout) {
                         return is_applied(rollout) && rollout.status == status;
                       });
}

/// Of failed roll-outs, as columns count them: one whose trials were discarded was given up.
inline std::string_view name_of_failure(RolloutStatus status) {
  return status == RolloutStatus::kDiscarded ? "given_up" : name(status);
}

/// Why it failed, for a person; may be empty.
std::string reason_of(const RunRecord& run, const RolloutRecord& rollout);

/// "roll-out 17: diverged: the rate of link 2 is not finite at 0.31 s", of the failed roll-out with
/// the highest number; empty if there is none.
std::string last_failure(const RunRecord& run);

/// As a mean takes them: mean_reward() of learner/core/run_record.h.
std::vector<double> rewards_of(const std::vector<Outcome>& evaluations);

/// Roll-outs up to the one after whose result a layer was left: a count, where RunRecord::switches
/// holds numbers from 0. With one roll-out in flight it is the number of the next layer's first.
inline int rollouts_before(int switched) { return switched + 1; }

/// Of the first switch. Precondition: the run has switched.
inline int rollouts_before_switch(const RunRecord& run) {
  return rollouts_before(run.switches.front());
}

}  // namespace treeroll
