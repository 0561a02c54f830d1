// Whom to believe where nobody signs: what a worker says twice, and what most of them say.
#include <fmt/format.h>

#include <algorithm>

#include "common/task_facts/task_agreement.h"
#include "learner/core/workforce.h"

namespace treeroll::learner {
namespace {

/// Of the first distrust; each further one lasts twice as long.
constexpr Duration kDistrustLasts = kLeftOutLasts;
constexpr int kDistrustDoublingsMax = 6;

constexpr const char* kRangeKind = "rewards out of range";

}  // namespace

/// A reward that no sound worker gives has come in this one's name. Anybody could have said it: the
/// worker's next word tells whether it was its own. Nothing has been read: an answer of its own may
/// come under this index.
bool Workforce::suspect(const Turn& turn, WorkerEntry& worker,
                        const protocol::RolloutResult& result, std::int64_t index,
                        const TaskDescription& facts) {
  // Its word of this index has been read: this is another's.
  if (worker.results_read.contains(index)) return note_unasked(turn, worker);
  if (worker.suspicion) return false;
  ++ledger_.counters.rejected;
  worker.suspicion = {index, result.key};
  turn.write(
      {LogLine::Level::kError, kRangeKind,
       fmt::format("{} gave reward {} outside the task's range {} to {}: refused, and "
                   "its next words tell whether that was its own",
                   describe(worker), result.outcome.reward(), facts.reward_min, facts.reward_max)});
  return false;
}

/// Its own it is if it has given an answer of this index and does not work on the roll-out.
void Workforce::settle_suspicion(const Turn& turn, WorkerEntry& worker,
                                 const protocol::HeldRollouts& held) {
  if (!worker.suspicion) return;
  const WorkerEntry::Suspicion suspicion = *worker.suspicion;
  const bool holds = std::ranges::find(held.keys, suspicion.key) != held.keys.end();
  const bool tells = held.first <= suspicion.key && suspicion.key <= held.last;
  if (!holds && !tells) return;  // another message does
  worker.suspicion.reset();
  if (holds || held.last_index < suspicion.index) {
    ++ledger_.counters.unasked;
    turn.warn("strangers",
              fmt::format("{} has not given the reward out of range: somebody spoke in its name; "
                          "keys keep strangers out (--key-file)",
                          describe(worker)));
    return;
  }
  // So it has been read. It is not to be kept: asked again the worker would repeat it.
  worker.results_read.note(suspicion.index, suspicion.index);
  if (num_unsynced_ == 0) worker.last_index_settled = worker.results_read.last_without_gap();
  acknowledge(worker.id, turn.now);
  const Duration lasts = distrust(turn, worker);
  turn.write({LogLine::Level::kError, kRangeKind,
              fmt::format("{} stands by its reward out of range: it gets no work for {:.0f} s",
                          describe(worker), to_seconds(lasts))});
}

/// It gets no work. @return for how long
Duration Workforce::distrust(const Turn& turn, WorkerEntry& worker) {
  const Duration lasts =
      kDistrustLasts * (1 << std::min(worker.num_distrusts++, kDistrustDoublingsMax));
  leave_out(turn, worker, lasts);
  return lasts;
}

void Workforce::leave_out(const Turn& turn, WorkerEntry& worker, Duration lasts) {
  worker.distrusted = true;
  worker.trusted_again = turn.now + lasts;
  ledger_.take_back_all(worker.id);
}

/// It has answered this well. Who has done so has not refused what it needs, nor given the reward
/// out of range: of two words one is another's.
void Workforce::clear_of_suspicion(const Turn& turn, WorkerEntry& worker,
                                   const Ledger::Entry& answered, protocol::RolloutKey key) {
  worker.num_distrusts = 0;
  const bool was_suspected = worker.suspicion && worker.suspicion->key == key;
  if (was_suspected) worker.suspicion.reset();
  if (!was_suspected && !forget_refusals_of(worker, answered.question)) return;
  ++ledger_.counters.unasked;
  turn.warn("strangers",
            fmt::format("{} answers what it is said to refuse or to have given a reward "
                        "out of range to: somebody spoke in its name; keys keep "
                        "strangers out (--key-file)",
                        describe(worker)));
}

/// @return whether it has refused what it needs for this
bool Workforce::forget_refusals_of(WorkerEntry& worker, const Question& question) {
  return std::erase_if(worker.refused, [&question](const auto& entry) {
           const auto& [definition, refusal] = entry;
           const bool is_needed =
               definition == question.task_id || definition == question.policy_id;
           return is_needed && !refusal.by_description;
         }) > 0;
}

/// Who works with a definition has not refused it: somebody did in its name.
void Workforce::forget_false_refusals(const Turn& turn, WorkerEntry& worker,
                                      const protocol::HeldRollouts& held) {
  if (worker.refused.empty()) return;
  for (const protocol::RolloutKey key : held.keys) {
    const Ledger::Entry* open = ledger_.find(key);
    if (!open || !open->was_asked(worker.id)) continue;
    if (!forget_refusals_of(worker, open->question)) continue;
    ++ledger_.counters.unasked;
    turn.warn("strangers",
              fmt::format("{} works with what it is said to refuse: somebody spoke in its name; "
                          "keys keep strangers out (--key-file)",
                          describe(worker)));
  }
}

void Workforce::take_description(const Turn& turn, WorkerEntry& worker, const ContentHash& task,
                                 const TaskDescription& said) {
  const bool is_known_beforehand = facts_.contains(task) && !accounts_.has(task);
  const bool has_answers = task_times_s_.contains(task);
  if (!is_known_beforehand && !has_answers) {
    accounts_.note(task, worker.id, said);
    elect_description(turn, task);
  } else if (!is_known_beforehand) {
    take_late_names(turn, task, said);
  }
  const TaskDescription* known = facts_of(task);
  std::optional<std::string> difference = known ? disagreement(*known, said) : std::nullopt;
  // What is known may name none, which agrees with all; the client's policy may have names.
  if (!difference) difference = client_.fault_of(task, said);
  difference ? refuse_description(turn, worker, task, *difference)
             : void(worker.refused.erase(task));
  // One that refuses too much has no room for the word that it is another task.
  if (!difference || worker.describes_otherwise(task)) worker.described.insert(task);
}

/// Its word was lost, or it has had the task from another learner.
void Workforce::ask_for_description(const Turn& turn, const WorkerEntry& worker,
                                    const ContentHash& task) {
  definitions_.publish(task_name(task), turn.now);
  turn.inform("descriptions of tasks",
              fmt::format("{} answers before it has said what its task is: its answers wait",
                          describe(worker)));
}

/// Anybody may have said it in its name: it is asked at once what it says itself.
void Workforce::refuse_description(const Turn& turn, WorkerEntry& worker, const ContentHash& task,
                                   const std::string& why) {
  const auto before = worker.refused.find(task);
  const bool is_new = before == worker.refused.end() || !before->second.by_description;
  refuse(turn, worker, task, why);
  const auto refused = worker.refused.find(task);
  if (refused == worker.refused.end()) return;  // it refuses too much
  refused->second.by_description = true;
  if (is_new && !worker.is_known) definitions_.publish(task_name(task), turn.now);
}

/// What most workers say a task is; who was first where as many say otherwise. Names that the
/// journal holds stay.
void Workforce::elect_description(const Turn& turn, const ContentHash& task) {
  const TaskDescription* now = facts_of(task);
  const auto now_said = now ? account_of(*now) : TaskAccounts::Account{};
  const auto noted = noted_signals_.find(task);
  TaskDescription facts;
  for (bool is_usable = false; !is_usable;) {
    const auto elected = accounts_.most_say(task, now_said);
    if (elected == now_said) return;
    auto chosen = elected;
    if (noted != noted_signals_.end()) chosen.names = noted->second;
    if (chosen == now_said) return;
    facts = description_of(chosen);
    const std::optional<std::string> why = client_.take_facts(turn, task, facts);
    is_usable = !why;
    if (is_usable) break;
    for (const protocol::WorkerId id : accounts_.drop(task, elected)) {
      if (WorkerEntry* worker = workers_.find(id)) refuse_description(turn, *worker, task, *why);
    }
  }
  if (const auto changed = now ? disagreement(*now, facts) : std::nullopt) {
    turn.warn(
        "descriptions of tasks",
        fmt::format("most workers describe a task otherwise than the first one did: {}", *changed));
  }
  facts_[task] = facts;
  for (const auto& [account, workers] : accounts_.of(task)) {
    const auto difference = disagreement(facts, description_of(account));
    for (const protocol::WorkerId id : workers) {
      WorkerEntry* worker = workers_.find(id);
      if (!worker) continue;
      difference ? refuse_description(turn, *worker, task, *difference)
                 : void(worker->refused.erase(task));
    }
  }
}

/// Workers of an earlier version name no signals. The first that does once answers are in is
/// believed.
void Workforce::take_late_names(const Turn& turn, const ContentHash& task,
                                const TaskDescription& said) {
  TaskDescription& known = facts_.at(task);
  const bool has_news = known.signals.empty() && !said.signals.empty();
  if (!has_news || noted_signals_.contains(task) || disagreement(known, said)) return;
  if (client_.fault_of(task, said)) return;  // its worker's trouble
  if (!client_.take_facts(turn, task, said)) known.signals = said.signals;
}

/// Before a result of the task: what only workers have said of its signals is for every fold.
void Workforce::note_signals(const Turn& turn, const ContentHash& task) {
  if (!accounts_.has(task) || noted_signals_.contains(task)) return;
  const SignalNames& names = facts_.at(task).signals;
  if (names.empty()) return;
  turn.effects.emplace_back(AppendSignals{{task, names}});
  recover(TaskSignals{task, names});
}

void Workforce::recover(const TaskSignals& signals) {
  noted_signals_[signals.task_id] = signals.names;
  client_.take_signals(signals);
}

}  // namespace treeroll::learner
