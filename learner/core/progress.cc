// What watchers are told.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/cut_text.h"
#include "common/protocol/pieces.h"
#include "learner/core/learner_core.h"
#include "learner/core/waiting.h"

namespace treeroll::learner {
namespace {

/// Status messages in one period, and bytes of best policies past which the others wait: watchers
/// need no more, and thousands of runs must not crowd out roll-outs. Runs take turns.
constexpr int kRunMessagesPerPeriod = 50;
constexpr std::size_t kPolicyBytesPerPeriod = 256 * 1024;

/// @return bytes of the policy
std::size_t send_in_pieces(const Turn& turn, protocol::BestPolicy best, const std::string& policy) {
  best.policy_id = content_hash(policy);
  best.policy_bytes = static_cast<std::int32_t>(policy.size());
  for (best.index = 0; best.index < protocol::num_pieces(policy.size()); ++best.index) {
    best.policy = protocol::piece_of(policy, best.index);
    turn.effects.emplace_back(SendMessage{best});
  }
  return policy.size();
}

protocol::RunStatus run_status(const Run& run, const Condition& condition) {
  const explore::Exploration& exploration = run.exploration();
  protocol::RunStatus status;
  status.run = run.index();
  status.condition = condition.name;
  status.repetition = run.repetition();
  status.layer = exploration.layer();
  status.num_rollouts = condition.exploration.num_rollouts;
  status.num_applied = exploration.num_told();
  status.num_failed = run.num_failed();
  status.num_switches = static_cast<std::int32_t>(exploration.switches().size());
  status.last_reward = run.last_reward();
  status.mean_reward = exploration.mean_reward().value_or(0);
  status.best_reward = exploration.best().rollout >= 0 ? exploration.best().reward : 0;
  status.reward_slope = exploration.reward_slope().value_or(0);
  status.noise_deviation =
      std::sqrt(exploration.noise().trace() / static_cast<double>(exploration.noise().rows()));
  status.done = run.done();
  return status;
}

}  // namespace

/// @return bytes of policies sent
std::size_t LearnerCore::publish_run(const Turn& turn, int index) {
  changed_runs_.erase(index);
  const Run& run = runs_[index];
  const Condition& condition = study_.conditions[run.condition()];
  protocol::RunStatus status = run_status(run, condition);
  status.learner_id = learner_id_;
  turn.effects.emplace_back(SendMessage{std::move(status)});

  const explore::Exploration::Best& best = run.exploration().best();
  double& announced = announced_best_.try_emplace(index, -1).first->second;
  if (best.rollout < 0 || best.reward <= announced) return 0;
  announced = best.reward;
  return send_in_pieces(turn,
                        {.learner_id = learner_id_,
                         .run = index,
                         .condition = condition.name,
                         .repetition = run.repetition(),
                         .rollout = best.rollout,
                         .reward = best.reward,
                         .policy_id = {},
                         .policy = {}},
                        run.best_policy());
}

void LearnerCore::publish_status(const Turn& turn) {
  std::size_t policy_bytes = 0;
  for (int sent = 0; sent < kRunMessagesPerPeriod && policy_bytes < kPolicyBytesPerPeriod &&
                     !changed_runs_.empty();
       ++sent) {
    auto next = changed_runs_.upper_bound(last_status_run_);
    if (next == changed_runs_.end()) next = changed_runs_.begin();
    last_status_run_ = *next;
    policy_bytes += publish_run(turn, last_status_run_);
  }

  const LedgerCounters now_counted = counters();
  protocol::LearnerStatus status;
  status.learner_id = learner_id_;
  status.study = study_.name;
  status.waiting_for =
      cut_text(why_waiting(study_, task_ids_, workforce_, turn.now), protocol::kStringBytesMax);
  status.elapsed_s = to_seconds(turn.now - started_at_);
  status.num_runs = static_cast<std::int32_t>(runs_.size());
  status.num_runs_done = num_done_;
  status.num_workers = workforce_.workers().num_joined();
  status.num_evaluators = workforce_.workers().num_evaluators();
  status.num_rollouts = num_rollouts_;
  status.num_evaluations = static_cast<std::int64_t>(runs_.size());
  status.num_evaluated = num_evaluated_;
  status.num_issued = now_counted.issued;
  status.num_applied = now_counted.applied;
  status.num_pending = now_counted.pending;
  status.num_late = now_counted.late;
  status.num_duplicate = now_counted.duplicate;
  status.num_failed = now_counted.failed;
  status.num_rejected = now_counted.rejected;
  status.num_reissued = now_counted.reissued;
  status.num_conflicting = now_counted.conflicting;
  for (const Run& run : runs_) {
    const explore::Exploration::Best& best = run.exploration().best();
    if (best.rollout >= 0) status.best_reward = std::max(status.best_reward, best.reward);
  }
  turn.effects.emplace_back(SendMessage{std::move(status)});
}

}  // namespace treeroll::learner
