#include "learner/core/run_messages.h"

#include <cmath>
#include <string>

#include "common/protocol/pieces.h"

namespace treeroll::learner {
namespace {

const Condition& condition_of(const Run& run, const Study& study) {
  return study.conditions[static_cast<std::size_t>(run.condition())];
}

}  // namespace

protocol::RunStatus run_status(const Run& run, const Study& study, protocol::LearnerId learner) {
  const Condition& condition = condition_of(run, study);
  const explore::Exploration& exploration = run.exploration();
  protocol::RunStatus status;
  status.learner_id = learner;
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

std::vector<protocol::BestPolicy> best_policy(const Run& run, const Study& study,
                                              protocol::LearnerId learner) {
  const std::string policy = run.best_policy();
  const ContentHash policy_id = content_hash(policy);
  const explore::Exploration::Best& best = run.exploration().best();
  std::vector<protocol::BestPolicy> pieces;
  for (int index = 0; index < protocol::num_pieces(policy.size()); ++index) {
    pieces.push_back({.learner_id = learner,
                      .run = run.index(),
                      .condition = condition_of(run, study).name,
                      .repetition = run.repetition(),
                      .rollout = best.rollout,
                      .reward = best.reward,
                      .policy_id = policy_id,
                      .policy_bytes = static_cast<std::int32_t>(policy.size()),
                      .index = index,
                      .policy = std::string(protocol::piece_of(policy, index))});
  }
  return pieces;
}

}  // namespace treeroll::learner
