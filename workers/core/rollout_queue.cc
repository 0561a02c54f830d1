#include "workers/core/rollout_queue.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "common/base/check.h"

namespace treeroll::worker {
namespace {

/// Ready roll-outs that are looked at for each that may be taken: enough where a learner has a few
/// tasks in turn.
constexpr std::size_t kLooksPerPlace = 8;

}  // namespace

HeldRollout* RolloutQueue::find(const RolloutName& name) {
  const auto found = held_.find(name);
  return found == held_.end() ? nullptr : &found->second;
}

const HeldRollout* RolloutQueue::find(const RolloutName& name) const {
  const auto found = held_.find(name);
  return found == held_.end() ? nullptr : &found->second;
}

HeldRollout& RolloutQueue::add(const RolloutName& name, protocol::RolloutRequest request,
                               std::int64_t sequence, TimePoint now) {
  const auto [place, is_new] = held_.try_emplace(name, HeldRollout{.request = std::move(request),
                                                                   .sequence = sequence,
                                                                   .arrival = next_arrival_++,
                                                                   .since = now});
  CHECK(is_new, "a roll-out held twice");
  ++tasks_[place->second.request.task_id];
  if (place->second.lacks_theta()) {
    thetas_[{name.learner, *place->second.request.theta_id}].insert(name.key);
  }
  return place->second;
}

void RolloutQueue::set_state(const RolloutName& name, RolloutState state) {
  HeldRollout& rollout = held_.at(name);
  if (rollout.state == RolloutState::kReady) {
    auto& row = ready_.at(name.learner);
    row.erase(rollout.arrival);
    if (row.empty()) ready_.erase(name.learner);
  }
  rollout.state = state;
  if (state == RolloutState::kReady) ready_[name.learner].emplace(rollout.arrival, name.key);
}

void RolloutQueue::remove(const RolloutName& name) {
  set_state(name, RolloutState::kWaiting);
  const HeldRollout& rollout = held_.at(name);
  if (rollout.lacks_theta()) waits_no_more(name, *rollout.request.theta_id);
  const auto task = tasks_.find(rollout.request.task_id);
  if (--task->second == 0) tasks_.erase(task);
  held_.erase(name);
}

bool RolloutQueue::any_ready() const {
  return std::any_of(ready_.begin(), ready_.end(),
                     [](const auto& entry) { return !entry.second.empty(); });
}

std::optional<RolloutName> RolloutQueue::take() {
  if (ready_.empty()) return std::nullopt;
  auto row = ready_.upper_bound(last_served_);
  if (row == ready_.end()) row = ready_.begin();
  last_served_ = row->first;
  const RolloutName name{row->first, row->second.begin()->second};
  set_state(name, RolloutState::kRunning);
  return name;
}

std::vector<RolloutName> RolloutQueue::take_beside(const RolloutName& first, std::size_t num_max,
                                                   std::size_t theta_numbers_max) {
  std::vector<RolloutName> names;
  const auto row = ready_.find(first.learner);
  if (row == ready_.end()) return names;
  const protocol::RolloutRequest& like = held_.at(first).request;
  std::size_t theta_numbers = like.theta.size();
  std::size_t num_looks = kLooksPerPlace * num_max;
  for (const auto& [arrival, key] : row->second) {
    if (names.size() == num_max || num_looks-- == 0) break;
    const HeldRollout& held = held_.at({first.learner, key});
    if (held.request.task_id != like.task_id || held.mishaps.alone) continue;
    theta_numbers += held.request.theta.size();
    if (theta_numbers > theta_numbers_max) break;
    names.push_back({first.learner, key});
  }
  for (const RolloutName& name : names) set_state(name, RolloutState::kRunning);
  return names;
}

std::vector<protocol::RolloutKey> RolloutQueue::keys(protocol::LearnerId learner) const {
  std::vector<protocol::RolloutKey> keys;
  for (const RolloutName& name : of_learner(learner)) keys.push_back(name.key);
  return keys;
}

std::vector<RolloutName> RolloutQueue::in_state(RolloutState state) const {
  std::vector<RolloutName> names;
  for (const auto& [name, rollout] : held_) {
    if (rollout.state == state) names.push_back(name);
  }
  return names;
}

std::vector<RolloutName> RolloutQueue::of_learner(protocol::LearnerId learner) const {
  std::vector<RolloutName> names;
  auto place = held_.lower_bound(RolloutName{learner, {INT32_MIN, INT32_MIN}});
  for (; place != held_.end() && place->first.learner == learner; ++place) {
    names.push_back(place->first);
  }
  return names;
}

std::set<ContentHash> RolloutQueue::definitions(DefinitionKind kind) const {
  std::set<ContentHash> ids;
  for (const auto& [name, held] : held_) {
    ids.insert(kind == DefinitionKind::kTask ? held.request.task_id : held.request.policy_id);
  }
  return ids;
}

std::set<std::pair<protocol::LearnerId, DefinitionName>> RolloutQueue::waited_for() const {
  std::set<std::pair<protocol::LearnerId, DefinitionName>> names;
  for (const auto& [name, held] : held_) {
    names.insert({name.learner, {DefinitionKind::kTask, held.request.task_id}});
    names.insert({name.learner, {DefinitionKind::kPolicy, held.request.policy_id}});
    if (held.lacks_theta()) {
      names.insert({name.learner, {DefinitionKind::kTheta, *held.request.theta_id}});
    }
  }
  return names;
}

std::vector<RolloutName> RolloutQueue::without_theta(protocol::LearnerId learner,
                                                     const ContentHash& id) const {
  std::vector<RolloutName> names;
  const auto waiting = thetas_.find({learner, id});
  if (waiting == thetas_.end()) return names;
  for (const protocol::RolloutKey key : waiting->second) names.push_back({learner, key});
  return names;
}

void RolloutQueue::set_theta(const RolloutName& name, std::vector<double> theta) {
  HeldRollout& rollout = held_.at(name);
  waits_no_more(name, *rollout.request.theta_id);
  rollout.request.theta = std::move(theta);
}

void RolloutQueue::waits_no_more(const RolloutName& name, const ContentHash& theta_id) {
  const auto waiting = thetas_.find({name.learner, theta_id});
  waiting->second.erase(name.key);
  if (waiting->second.empty()) thetas_.erase(waiting);
}

}  // namespace treeroll::worker
