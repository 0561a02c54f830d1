#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/outcome.h"

namespace treeroll {

/// Different reasons that a run keeps; the journal has all.
inline constexpr int kReasonsPerRunMax = 254;
inline constexpr std::uint8_t kUnfiledReason = 255;  ///< one more than that

/// One applied roll-out. The only thing a learner keeps of each: small, for there may be 10^7.
struct RolloutRecord {
  double reward = 0;
  std::int16_t layer = 0;  ///< drawn at, 1 ..; 0: no result yet
  RolloutStatus status = RolloutStatus::kOk;
  std::uint8_t reason = 0;         ///< place in RunRecord::reasons, from 1; 0: none
  std::int32_t numeric_class = 0;  ///< of the worker it came from, by the learner's count
};

/// Files a reason among those of a run, each once: failures are many, their reasons few.
/// @return  RolloutRecord::reason
inline std::uint8_t file_reason(std::vector<std::string>& reasons, std::string_view reason) {
  if (reason.empty()) return 0;
  const auto place = std::find(reasons.begin(), reasons.end(), reason) - reasons.begin();
  if (place == kReasonsPerRunMax) return kUnfiledReason;
  if (place == static_cast<std::ptrdiff_t>(reasons.size())) reasons.emplace_back(reason);
  return static_cast<std::uint8_t>(place + 1);
}

/// What a run has come to: the source of every file and table.
struct RunRecord {
  std::string condition;
  int repetition = 0;
  int run = 0;
  std::vector<RolloutRecord> rollouts;  ///< by number; in arrival order there may be gaps
  double best_reward = 0;
  int best_rollout = -1;
  std::string best_policy;             ///< JSON of common/policy/policy.h, empty before any result
  std::string final_policy;            ///< the mean, in the same way
  std::optional<Outcome> start;        ///< of the start policy, outside the budget
  std::vector<Outcome> finals;         ///< of the final mean policy, outside the budget
  std::optional<double> final_reward;  ///< mean_reward() of these, once all are in
  std::vector<int> switches;           ///< roll-outs after whose result a layer was left
  std::vector<std::string> reasons;    ///< why roll-outs failed, each once
  int num_discarded = 0;               ///< trials that were void and were made again
};

/// Of several evaluations of one policy: those that failed count with 0, those that were discarded
/// do not. Nothing for none.
inline std::optional<double> mean_reward(const std::vector<Outcome>& evaluations) {
  double sum = 0;
  int count = 0;
  for (const Outcome& outcome : evaluations) {
    if (outcome.is_discarded()) continue;
    sum += outcome.reward();
    ++count;
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// Counters of the ledger: issued = applied + pending.
struct LedgerCounters {
  std::int64_t issued = 0;
  std::int64_t applied = 0;
  std::int64_t pending = 0;
  std::int64_t late = 0;       ///< accepted after their lease had expired
  std::int64_t duplicate = 0;  ///< answers to roll-outs that already had one
  std::int64_t failed = 0;     ///< applied with a status other than ok
  std::int64_t discarded = 0;  ///< trials that were void: accepted, and asked for again
  std::int64_t rejected = 0;   ///< answers refused: unknown, out of bounds, an older question
  std::int64_t reissued = 0;
  std::int64_t unasked = 0;      ///< answers, words and reports of nobody who was asked, refused
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
