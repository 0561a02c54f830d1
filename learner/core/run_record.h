#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/rollout_status.h"

namespace treeroll {

/// One applied roll-out. The only thing a learner keeps of each: small, for there may be 10^7.
struct RolloutRecord {
  double reward = 0;
  std::int16_t layer = 0;  ///< drawn at, 1 ..; 0: no result yet
  RolloutStatus status = RolloutStatus::kOk;
  std::int32_t numeric_class = 0;  ///< of the worker it came from, by the learner's count
};

/// What a run has come to: the source of every file and table.
struct RunRecord {
  std::string condition;
  int repetition = 0;
  int run = 0;
  std::vector<RolloutRecord> rollouts;  ///< by number; in arrival order there may be gaps
  double best_reward = 0;
  int best_rollout = -1;
  std::string best_policy;             ///< JSON of common/policy/policy.h, empty before any result
  std::optional<double> final_reward;  ///< of the final mean policy, outside the budget
  std::vector<int> switches;           ///< roll-outs after whose result a layer was left
};

/// Counters of the ledger: issued = applied + pending.
struct LedgerCounters {
  std::int64_t issued = 0;
  std::int64_t applied = 0;
  std::int64_t pending = 0;
  std::int64_t late = 0;       ///< accepted after their lease had expired
  std::int64_t duplicate = 0;  ///< answers to roll-outs that already had one
  std::int64_t failed = 0;     ///< applied with a status other than ok
  std::int64_t rejected = 0;   ///< answers refused: unknown, out of bounds, an older question
  std::int64_t reissued = 0;
  std::int64_t conflicting = 0;  ///< duplicates with another reward from the same numeric class
};

/// What one worker did for this study.
struct WorkerRecord {
  std::string host;
  int pid = 0;
  int num_evaluators = 0;
  std::int64_t num_accepted = 0;
  double first_heard_s = 0;  ///< since the learner's start
  double last_heard_s = 0;
};

}  // namespace treeroll
