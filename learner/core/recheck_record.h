#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "learner/core/known_worker.h"

/// What has come of roll-outs that were run again on another worker (study.recheck).
namespace treeroll {

/// Rewards of two numeric classes agree that differ by at most this share of the larger one: ODE's
/// last bits depend on the class, and a motion magnifies them.
inline constexpr double kRewardShareBetweenClasses = 1e-6;

struct RecheckedWorker {
  KnownWorker worker;
  std::int64_t num_compared = 0;   ///< its answers with those of others, each pair
  std::int64_t num_disagreed = 0;  ///< of these
  /// Roll-outs to which two others of its numeric class agree on another answer, and none of them
  /// on its own.
  std::int64_t num_outvoted = 0;
  bool operator==(const RecheckedWorker&) const = default;
};

/// Of two numeric classes, or of one with itself.
struct RecheckedClasses {
  std::int64_t num_compared = 0;  ///< pairs of answers
  std::int64_t num_disagreed = 0;
  double difference_max = 0;  ///< of two rewards, those that agree too
  bool operator==(const RecheckedClasses&) const = default;
};

struct RecheckRecord {
  std::int64_t num_rechecked = 0;  ///< roll-outs that have answers of two workers or more
  std::int64_t num_disputed = 0;   ///< of these: two answers disagree
  std::int64_t num_undecided = 0;  ///< of these: no two of a class outvote the one that is wrong
  std::map<protocol::WorkerId, RecheckedWorker> workers;
  /// By the names of both classes, the lesser one first.
  std::map<std::pair<std::string, std::string>, RecheckedClasses> classes;
  bool operator==(const RecheckRecord&) const = default;
};

}  // namespace treeroll
