// What the learner tells those who watch: the status messages, and why nothing moves.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/cut_text.h"
#include "learner/core/learner_core.h"

namespace treeroll {
namespace {

/// Status and best-policy messages in one period: watchers need no more, and thousands of runs
/// must not crowd out roll-outs. Runs take turns.
constexpr int kRunMessagesPerPeriod = 50;
constexpr Duration kPatience = std::chrono::seconds(3);

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

void LearnerCore::publish_run(int index, LearnerEffects& effects) {
  changed_runs_.erase(index);
  const Run& run = runs_[index];
  const Condition& condition = study_.conditions[run.condition()];
  protocol::RunStatus status = run_status(run, condition);
  status.learner_id = settings_.learner_id;
  effects.send.emplace_back(std::move(status));

  const explore::Exploration::Best& best = run.exploration().best();
  double& announced = announced_best_.try_emplace(index, -1).first->second;
  if (best.rollout < 0 || best.reward <= announced) return;
  announced = best.reward;
  std::string policy = run.best_policy();
  if (policy.empty()) return;
  effects.send.emplace_back(protocol::BestPolicy{settings_.learner_id, index, condition.name,
                                                 run.repetition(), best.rollout, best.reward,
                                                 std::move(policy)});
}

void LearnerCore::publish_status(TimePoint now, LearnerEffects& effects) {
  for (int sent = 0; sent < kRunMessagesPerPeriod && !changed_runs_.empty(); ++sent) {
    auto next = changed_runs_.upper_bound(last_status_run_);
    if (next == changed_runs_.end()) next = changed_runs_.begin();
    last_status_run_ = *next;
    publish_run(last_status_run_, effects);
  }

  const LedgerCounters now_counted = counters();
  protocol::LearnerStatus status;
  status.learner_id = settings_.learner_id;
  status.study = study_.name;
  status.waiting_for = cut_text(why_waiting(now), protocol::kStringBytesMax);
  status.elapsed_s = to_seconds(now - started_at_);
  status.num_runs = static_cast<std::int32_t>(runs_.size());
  status.num_runs_done = num_done_;
  status.num_workers = static_cast<std::int32_t>(workers_.all().size());
  status.num_evaluators = workers_.num_evaluators();
  status.num_rollouts = num_rollouts_;
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
  effects.send.emplace_back(std::move(status));
}

/// Lines of one kind may come by the thousand, from a flapping network or from hostile senders.
void LearnerCore::log(TimePoint now, LogLine line, LearnerEffects& effects) {
  log_limiter_.add(now, std::move(line), effects.log);
}

/// Why no usable worker takes this definition; nothing if one does.
std::optional<std::string> LearnerCore::refused_by_all(const ContentHash& definition) const {
  std::optional<std::string> reason;
  for (const auto& [id, worker] : workers_.all()) {
    if (!worker.usable()) continue;
    const auto refused = worker.refused.find(definition);
    if (refused == worker.refused.end()) return std::nullopt;
    reason = refused->second.reason;
  }
  return reason;
}

std::string LearnerCore::why_waiting(TimePoint now) const {
  if (now - last_progress_ < kPatience) return "";
  if (journal_is_behind()) {
    return fmt::format("the disk lags: {} results are not on stable storage yet", num_unsynced_);
  }
  if (workers_.all().empty()) return "no workers: none is heard on this LCM URL";

  int usable = 0;
  bool has_room = false;
  for (const auto& [id, worker] : workers_.all()) {
    usable += worker.usable();
    has_room = has_room || (worker.usable() && worker.free_slots > 0);
  }
  if (usable == 0) {
    return fmt::format(
        "none of the {} workers takes roll-outs: they start, drain, are distrusted or refuse too "
        "much",
        workers_.all().size());
  }
  for (std::size_t c = 0; c < task_ids_.size(); ++c) {
    const std::string& condition = study_.conditions[c].name;
    if (const auto reason = refused_by_all(task_ids_[c])) {
      return fmt::format("the workers lack the task of condition {}: {}", condition, *reason);
    }
    if (!facts_.contains(task_ids_[c])) {
      return fmt::format("no worker has described the task of condition {} yet", condition);
    }
  }
  for (const protocol::RolloutKey key : ledger_.ready()) {
    if (const auto reason = refused_by_all(ledger_.find(key)->question.policy_id)) {
      return fmt::format("the workers refuse the policy of run {}: {}", key.run, *reason);
    }
  }
  if (ledger_.num_leased() > 0) {
    return fmt::format("{} roll-outs are with {} workers, the last answer came {:.0f} s ago",
                       ledger_.num_leased(), workers_.all().size(),
                       to_seconds(now - last_progress_));
  }
  if (!has_room) return fmt::format("queue full: none of the {} workers has room", usable);
  return fmt::format("all leases have expired, {} roll-outs wait to be issued again",
                     ledger_.ready().size());
}

}  // namespace treeroll
