#pragma once

#include "common/base/rollout_status.h"

namespace treeroll::learner {

/// What a roll-out has come to, and on what kind of processor.
struct Answer {
  double reward = 0;
  RolloutStatus status = RolloutStatus::kOk;
  int numeric_class = 0;  ///< by the learner's count
};

/// Of an answer whose worker was another incarnation's, or of one class too many: it compares with
/// nothing.
inline constexpr int kUnknownClass = -1;

}  // namespace treeroll::learner
