#pragma once

#include <algorithm>
#include <cstdint>

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

}  // namespace treeroll
