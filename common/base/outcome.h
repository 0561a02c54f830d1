#pragma once

#include <cstddef>
#include <string>
#include <utility>

#include "common/base/rollout_status.h"

namespace treeroll {

/// Of a reason for a person; longer ones are cut where they leave the process that gives them.
inline constexpr std::size_t kOutcomeReasonBytesMax = 256;

/// What a roll-out has come to. The reward of one that failed is 0, whatever was said of it; one
/// that was ok has no reason.
///
///   return Outcome::ok(elementary::exp(-cost));
///   return Outcome::failed(RolloutStatus::kDiverged, "the first link's rate is not finite");
///   return Outcome::discarded("the operator has caught the arm");  // try the same policy again
class Outcome {
 public:
  Outcome() = default;
  /// Of values that come from outside: a reward counts only beside kOk, a reason only without it.
  Outcome(double reward, RolloutStatus status, std::string reason = {})
      : reward_(status == RolloutStatus::kOk ? reward : 0),
        status_(status),
        reason_(status == RolloutStatus::kOk ? std::string() : std::move(reason)) {}
  static Outcome ok(double reward) { return {reward, RolloutStatus::kOk}; }
  static Outcome failed(RolloutStatus status, std::string reason = {}) {
    return {0, status, std::move(reason)};
  }
  /// The trial is void: it costs no budget, and the same theta is tried again.
  static Outcome discarded(std::string reason = {}) {
    return {0, RolloutStatus::kDiscarded, std::move(reason)};
  }

  double reward() const { return reward_; }
  RolloutStatus status() const { return status_; }
  const std::string& reason() const { return reason_; }  ///< for a person; may be empty
  bool is_ok() const { return status_ == RolloutStatus::kOk; }
  bool is_discarded() const { return status_ == RolloutStatus::kDiscarded; }
  /// Whether the two say the same of the policy; reasons are words.
  bool agrees_with(const Outcome& other) const {
    return reward_ == other.reward_ && status_ == other.status_;
  }
  bool operator==(const Outcome&) const = default;

 private:
  double reward_ = 0;
  RolloutStatus status_ = RolloutStatus::kOk;
  std::string reason_;
};

}  // namespace treeroll
