#pragma once

#include "common/base/rollout_status.h"

namespace treeroll {

/// What a roll-out has come to. The reward of one that failed is 0, whatever was said of it.
///
///   return Outcome::ok(elementary::exp(-cost));
///   return Outcome::failed(RolloutStatus::kDiverged);
class Outcome {
 public:
  Outcome() = default;
  /// Of two numbers that come from outside: a reward counts only beside kOk.
  Outcome(double reward, RolloutStatus status)
      : reward_(status == RolloutStatus::kOk ? reward : 0), status_(status) {}
  static Outcome ok(double reward) { return {reward, RolloutStatus::kOk}; }
  static Outcome failed(RolloutStatus status) { return {0, status}; }

  double reward() const { return reward_; }
  RolloutStatus status() const { return status_; }
  bool is_ok() const { return status_ == RolloutStatus::kOk; }
  bool operator==(const Outcome&) const = default;

 private:
  double reward_ = 0;
  RolloutStatus status_ = RolloutStatus::kOk;
};

}  // namespace treeroll
