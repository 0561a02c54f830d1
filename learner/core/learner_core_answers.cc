// What answers do: accepted or not, learnt from, and the next roll-outs drawn.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/random_stream.h"
#include "learner/core/dispatch.h"
#include "learner/core/learner_core.h"

namespace treeroll {
namespace {

constexpr double kTimingWeight = .1;
/// What a worker says it holds is not lost, and its next heartbeat or answer comes before this.
constexpr Duration kHeldLeaseMin = std::chrono::seconds(1);

/// False for what is no number, too.
bool is_in_range(double reward, const TaskDescription& facts) {
  return reward >= facts.reward_min && reward <= facts.reward_max;
}

}  // namespace

void LearnerCore::accept(WorkerEntry& worker, const protocol::RolloutResult& result, TimePoint now,
                         LearnerEffects& effects) {
  const protocol::RolloutKey key = result.key;
  const bool in_study = key.run >= 0 && key.run < static_cast<int>(runs_.size());
  const TaskDescription* facts = in_study ? facts_of(key.run) : nullptr;
  if (!facts || worker.distrusted) {  // without facts nothing of this run has been issued
    ++ledger_.counters.rejected;
    return;
  }
  const Ledger::Entry* open = ledger_.find(key);
  if (!open) return compare_with_accepted(worker, result, *facts, now, effects);
  if (open->question.content != result.content) {
    ++ledger_.counters.rejected;  // an answer to an older question
    return;
  }
  const bool ok = result.status == RolloutStatus::kOk;
  if (ok && !is_in_range(result.reward, *facts)) {
    return distrust(worker, result, *facts, now, effects);
  }

  note_timing(worker, result, *open, now);
  const Ledger::Entry entry = ledger_.close(key);
  if (!entry.lease || entry.lease->worker != worker.id) ++ledger_.counters.late;
  if (entry.lease) {
    if (WorkerEntry* holder = workers_.find(entry.lease->worker)) holder->leases.erase(key);
  }
  ++worker.num_accepted;
  last_progress_ = now;
  const AcceptedResult accepted{key, result.content, ok ? result.reward : 0, result.status,
                                worker.id};
  effects.accepted.push_back(accepted);
  ++num_unsynced_;
  learn(accepted, numeric_class(worker.numeric_class), now, effects);
}

/// What an earlier incarnation accepted is accepted again, if it answers what is asked now.
void LearnerCore::recover(const AcceptedResult& result, TimePoint now, LearnerEffects& effects) {
  const Ledger::Entry* open = ledger_.find(result.key);
  if (!open || open->question.content != result.content) {
    failure_ = fmt::format("the journal answers run {} roll-out {}, which this study {}",
                           result.key.run, result.key.number,
                           open ? "draws with other numbers" : "does not ask for at this place");
    outcome_ = Outcome::kFailed;
    return;
  }
  const TaskDescription* facts = facts_of(result.key.run);
  if (facts && result.status == RolloutStatus::kOk && !is_in_range(result.reward, *facts)) {
    failure_ = fmt::format(
        "the journal gives run {} roll-out {} reward {}, outside the task's range {} to {}",
        result.key.run, result.key.number, result.reward, facts->reward_min, facts->reward_max);
    outcome_ = Outcome::kFailed;
    return;
  }
  ledger_.close(result.key);
  learn(result, kUnknownClass, now, effects);
}

const TaskDescription* LearnerCore::facts_of(int run) const {
  const auto known = facts_.find(task_ids_[runs_[run].condition()]);
  return known == facts_.end() ? nullptr : &known->second;
}

/// An answer to a roll-out that is not open: a duplicate, or to nothing that was asked.
void LearnerCore::compare_with_accepted(const WorkerEntry& worker,
                                        const protocol::RolloutResult& result,
                                        const TaskDescription& facts, TimePoint now,
                                        LearnerEffects& effects) {
  const std::optional<Run::Answer> before = runs_[result.key.run].answer_of(result.key.number);
  if (!before) {
    ++ledger_.counters.rejected;
    return;
  }
  ++ledger_.counters.duplicate;
  const bool comparable = facts.deterministic && before->numeric_class != kUnknownClass &&
                          before->numeric_class == numeric_class(worker.numeric_class);
  if (!comparable || (before->reward == result.reward && before->status == result.status)) return;
  ++ledger_.counters.conflicting;
  log(now,
      {LogLine::Level::kWarning, "suspicious results",
       fmt::format("{} gave reward {} where {} was accepted, run {} roll-out {}: one of two "
                   "workers of the same numeric class is broken",
                   describe(worker), result.reward, before->reward, result.key.run,
                   result.key.number)},
      effects);
}

void LearnerCore::distrust(WorkerEntry& worker, const protocol::RolloutResult& result,
                           const TaskDescription& facts, TimePoint now, LearnerEffects& effects) {
  ++ledger_.counters.rejected;
  worker.distrusted = true;
  log(now,
      {LogLine::Level::kError, "rewards out of range",
       fmt::format("{} gave reward {} outside the task's range {} to {}: it gets no more work",
                   describe(worker), result.reward, facts.reward_min, facts.reward_max)},
      effects);
  const std::set<protocol::RolloutKey> leases = worker.leases;
  for (const protocol::RolloutKey key : leases) take_back(worker, key);
}

void LearnerCore::learn(const AcceptedResult& result, int numeric_class, TimePoint now,
                        LearnerEffects& effects) {
  Run& run = runs_[result.key.run];
  changed_runs_.insert(result.key.run);
  ledger_.counters.applied +=
      run.accept(result.key.number, result.reward, result.status, numeric_class);
  if (run.done()) {
    finish_run(run, effects);
  } else {
    draw(run, now, effects);
  }
}

void LearnerCore::note_timing(WorkerEntry& worker, const protocol::RolloutResult& result,
                              const Ledger::Entry& entry, TimePoint now) {
  const double duration_s = static_cast<double>(result.duration_ns) * 1e-9;
  rollout_time_s_ = rollout_time_s_ == 0
                        ? duration_s
                        : rollout_time_s_ + kTimingWeight * (duration_s - rollout_time_s_);
  if (!entry.lease || entry.lease->worker != worker.id) return;
  const double answer_s = to_seconds(now - entry.lease->issued_at);
  double& median_s = worker.answer_time_s ? *worker.answer_time_s
                                          : worker.answer_time_s.emplace(std::max(answer_s, 1e-6));
  // The median, in small steps: answers that were lost at first come late and would stretch a mean.
  median_s *= answer_s > median_s ? 1 + kTimingWeight : 1 / (1 + kTimingWeight);
}

void LearnerCore::take_back(WorkerEntry& worker, protocol::RolloutKey key) {
  ledger_.take_back(key);
  worker.leases.erase(key);
}

bool LearnerCore::answers_open_question(const protocol::RolloutResult& result) const {
  const Ledger::Entry* open = ledger_.find(result.key);
  return open && open->question.content == result.content;
}

void LearnerCore::extend_leases(WorkerEntry& worker, const std::vector<protocol::RolloutKey>& held,
                                TimePoint now) {
  const TimePoint extended = now + std::max(kHeldLeaseMin, lease_duration(worker, rollout_time_s_));
  for (const protocol::RolloutKey key : held) ledger_.extend(key, worker.id, extended);
}

/// Leases of requests that were lost on the way: the worker has seen a later message, all its
/// answers are in, and it holds neither the roll-out nor an answer to it.
void LearnerCore::reconcile(WorkerEntry& worker, std::int64_t last_batch,
                            const std::vector<protocol::RolloutKey>& held, TimePoint now) {
  extend_leases(worker, held, now);
  const std::set<protocol::RolloutKey> holds(held.begin(), held.end());
  const std::set<protocol::RolloutKey> leases = worker.leases;
  for (const protocol::RolloutKey key : leases) {
    const bool lost = !holds.contains(key) && ledger_.find(key)->lease->batch <= last_batch;
    if (!lost) continue;
    ledger_.take_back_lost(key);
    worker.leases.erase(key);
  }
}

void LearnerCore::draw(Run& run, TimePoint now, LearnerEffects& effects) {
  for (Run::Wanted& wanted : run.take_wanted()) {
    std::map<int, ContentHash>& ids = policy_ids_[run.index()];
    if (!ids.contains(wanted.layer)) {
      ids[wanted.layer] = policies_.add(to_json(run.exploration().policy(wanted.layer)));
      publish_policy(ids[wanted.layer], now, effects);
    }
    const protocol::RolloutKey key{run.index(), wanted.number};
    Question question;
    question.task_id = task_ids_[run.condition()];
    question.policy_id = ids[wanted.layer];
    question.task_seed = static_cast<std::int64_t>(
        RandomStream(study_.seed, static_cast<std::uint32_t>(run.repetition()),
                     static_cast<std::uint32_t>(wanted.number), RandomPurpose::kTaskSeed)
            .next_bits());
    question.theta = std::move(wanted.theta);
    seal(question, key);
    ledger_.draw(key, std::move(question));
  }
}

void LearnerCore::finish_run(Run& run, LearnerEffects& effects) {
  for (const auto& [layer, id] : policy_ids_[run.index()]) policies_.release(id);
  policy_ids_[run.index()].clear();
  ++num_done_;
  publish_run(run.index(), effects);
  if (num_done_ < static_cast<int>(runs_.size())) return;
  publish_status(last_progress_, effects);
  outcome_ = Outcome::kDone;
}

}  // namespace treeroll
