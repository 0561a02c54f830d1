// What watchers are told.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/cut_text.h"
#include "common/base/shown_reward.h"
#include "learner/core/learner_core.h"
#include "learner/core/run_messages.h"
#include "learner/core/waiting.h"

namespace treeroll::learner {
namespace {

/// What a message takes of a receiver's buffer beside its texts, of which a policy's piece is one:
/// the kernel counts so much for the smallest.
constexpr std::size_t kMessageBytes = 1024;
/// Half of the buffer that Linux gives a socket.
constexpr std::size_t kLastWordsBytes = 100 * 1024;

/// "run 3 (tree, repetition 3)".
std::string named(const Run& run, const Study& study) {
  return fmt::format("run {} ({}, repetition {})", run.index(),
                     study.conditions[static_cast<std::size_t>(run.condition())].name,
                     run.repetition());
}

std::string named_rollout(int number) {
  if (number == Run::kStart) return "the start policy";
  return number < 0 ? "the final policy" : fmt::format("roll-out {}", number);
}

}  // namespace

/// Before the run takes it.
void LearnerCore::note_failure(const Turn& turn, const Run& run, const AcceptedResult& result) {
  const treeroll::Outcome& outcome = result.outcome;
  const int number = result.key.number;
  const std::string_view status = name(outcome.status());
  std::string words = fmt::format("{}, {}: {}", named(run, study_), named_rollout(number), status);
  if (!outcome.reason().empty()) words += ": " + outcome.reason();
  const bool is_given_up = run.would_give_up(number, outcome);
  if (is_given_up) {
    words += fmt::format("; more than {} of its trials are void{}", study_.discards_max,
                         number < 0 ? "" : ", which ends the run");
  }
  if (!outcome.is_discarded() || is_given_up) last_failure_ = words;
  if (!at_work_since_) return;  // an earlier incarnation has said it
  if (is_given_up) return turn.warn("roll-outs given up", std::move(words));
  turn.warn(status, std::move(words));
}

/// Of a task that is not deterministic one reward is luck: there only the table says it, of all
/// repetitions together.
void LearnerCore::say_if_start_is_not_beaten(const Turn& turn, const Run& run) const {
  const TaskDescription* facts =
      workforce_.facts_of(task_ids_[static_cast<std::size_t>(run.condition())]);
  const std::optional<Answer> start = run.answer_of(Run::kStart);
  const std::optional<Answer> final_policy = run.answer_of(Run::kFinal);
  if (!at_work_since_ || !facts || !facts->deterministic || !start->outcome.is_ok()) return;
  if (final_policy->outcome.is_discarded()) return;
  const explore::Exploration::Best& best = run.exploration().best();
  const double best_reward = best.rollout >= 0 ? best.reward : 0;
  const double final_reward = final_policy->outcome.reward();
  if (std::max(best_reward, final_reward) > start->outcome.reward()) return;
  turn.warn("runs that do not beat their start",
            fmt::format("{} never beats its start policy, whose reward is {}: its best roll-out "
                        "has {}, its final policy {}",
                        named(run, study_), shown_reward(start->outcome.reward()),
                        shown_reward(best_reward), shown_reward(final_reward)));
}

/// @param repeats  the best policy goes along even if it is no news
/// @return what it takes of a receiver's buffer
std::size_t LearnerCore::publish_run(const Turn& turn, int index, bool repeats) {
  changed_runs_.erase(index);
  const Run& run = runs_[index];
  turn.effects.emplace_back(SendMessage{run_status(run, study_, learner_id_)});
  const explore::Exploration::Best& best = run.exploration().best();
  double& announced = announced_best_.try_emplace(index, -1).first->second;
  if (best.rollout < 0 || (best.reward <= announced && !repeats)) return kMessageBytes;
  announced = best.reward;
  return kMessageBytes + publish_best(turn, index);
}

std::size_t LearnerCore::publish_best(const Turn& turn, int index) {
  std::size_t bytes = 0;
  for (protocol::BestPolicy& piece : best_policy(runs_[index], study_, learner_id_)) {
    bytes += piece.policy.size() + kMessageBytes;
    turn.effects.emplace_back(SendMessage{std::move(piece)});
  }
  return bytes;
}

/// Of runs, as far as the bytes go: what has changed, for which half of them is enough while there
/// is something to repeat, and what is repeated. All take turns.
void LearnerCore::publish_news(const Turn& turn, std::size_t bytes_max) {
  std::size_t bytes = 0;
  const std::size_t changed_max = num_to_repeat_ > 0 ? bytes_max / 2 : bytes_max;
  while (bytes < changed_max && !changed_runs_.empty()) {
    auto next = changed_runs_.upper_bound(last_changed_run_);
    if (next == changed_runs_.end()) next = changed_runs_.begin();
    last_changed_run_ = *next;
    bytes += publish_run(turn, last_changed_run_, false);
  }
  for (; bytes < bytes_max && num_to_repeat_ > 0; --num_to_repeat_) {
    bytes += publish_run(turn, next_repeated_run_, true);
    next_repeated_run_ = (next_repeated_run_ + 1) % static_cast<int>(runs_.size());
  }
}

/// Everything once more, as far as a receiver's buffer has room: nothing comes after.
void LearnerCore::publish_last_words(const Turn& turn) {
  publish_status(turn);
  num_to_repeat_ = static_cast<int>(runs_.size());
  publish_news(turn, kLastWordsBytes);
}

void LearnerCore::publish_status(const Turn& turn) {
  protocol::LearnerStatus told = status(turn.now);
  told.num_workers = workforce_.count_workers(turn.now);
  turn.effects.emplace_back(SendMessage{std::move(told)});
}

protocol::LearnerStatus LearnerCore::status(TimePoint now) const {
  const LedgerCounters now_counted = counters();
  protocol::LearnerStatus status;
  status.learner_id = learner_id_;
  status.host = host_;
  status.pid = pid_;
  status.study = study_.name;
  status.waiting_for = cut_text(why_waiting(study_, task_ids_, workforce_, at_switch_.size(), now),
                                protocol::kStringBytesMax);
  status.elapsed_s = to_seconds(now - started_at_);
  status.num_runs = static_cast<std::int32_t>(runs_.size());
  status.num_runs_done = num_done_;
  status.num_workers = workforce_.workers().num_joined();
  status.num_evaluators = workforce_.workers().num_evaluators();
  status.num_evaluations = static_cast<std::int64_t>(runs_.size()) * (1 + study_.final_evaluations);
  status.num_evaluated = num_evaluated_;
  status.num_issued = now_counted.issued;
  status.num_applied = now_counted.applied;
  status.num_pending = now_counted.pending;
  status.num_late = now_counted.late;
  status.num_duplicate = now_counted.duplicate;
  status.num_failed = now_counted.failed;
  status.num_discarded = now_counted.discarded;
  status.last_failure = cut_text(last_failure_, protocol::kStringBytesMax);
  status.num_rejected = now_counted.rejected + now_counted.unasked;
  status.num_reissued = now_counted.reissued;
  status.num_conflicting = now_counted.conflicting;
  for (const Run& run : runs_) {
    const explore::Exploration& exploration = run.exploration();
    // One that has ended early draws no more.
    status.num_rollouts += exploration.done()
                               ? exploration.num_told()
                               : study_.conditions[run.condition()].exploration.num_rollouts;
    const explore::Exploration::Best& best = exploration.best();
    if (best.rollout >= 0) status.best_reward = std::max(status.best_reward, best.reward);
  }
  return status;
}

}  // namespace treeroll::learner
