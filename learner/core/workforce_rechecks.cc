// What another worker makes of the same: a share of the roll-outs is run again (study.recheck).
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/for_log.h"
#include "learner/core/dispatch.h"
#include "learner/core/workforce.h"

namespace treeroll::learner {
namespace {

constexpr const char* kRecheckKind = "roll-outs run again";
constexpr const char* kSetAsideKind = "workers set aside";

std::string rewarded(const Opinion& opinion) {
  const Outcome& outcome = opinion.outcome;
  return fmt::format("{} of {}",
                     outcome.is_ok() ? fmt::format("reward {}", outcome.reward())
                                     : std::string(name(outcome.status())),
                     described(opinion.worker));
}

}  // namespace

/// The client takes a result; perhaps one more worker is asked for the same. What is opened follows
/// from the journal alone: of a task that must not be run again a question waits too, and is given
/// to nobody.
void Workforce::hand_over(const Turn& turn, Ledger::Entry answered, const AcceptedResult& result,
                          int numeric_class) {
  // What is void says nothing of the policy, and its key is asked for again.
  const bool is_run_again = !result.outcome.is_discarded() && client_.is_rechecked(result.key);
  if (!is_run_again) return client_.take(turn, result, numeric_class);
  const TaskDescription* facts = facts_of(answered.question.task_id);
  const bool tells_nothing = facts != nullptr && !may_run_again(*facts);
  if (tells_nothing && !std::exchange(has_told_of_no_rechecks_, true)) {
    turn.inform(kRecheckKind,
                fmt::format("roll-outs of run {} are not run again (study.recheck): its task {}",
                            result.key.run,
                            facts->repeatable ? "gives one policy different rewards"
                                              : "must not be started twice"));
  }
  // The run may have ended with this result, and let go of its policy.
  definitions_.keep(policy_name(answered.question.policy_id));
  client_.take(turn, result, numeric_class);
  const auto given_up =
      rechecks_.open(result.key, {noted_worker(result.worker_id), result.outcome});
  if (given_up) give_up(*given_up);
  ask_one_more(result.key, std::move(answered), result.worker_id);
}

/// Of the next worker, with the same question.
void Workforce::ask_one_more(protocol::RolloutKey key, Ledger::Entry answered,
                             protocol::WorkerId by) {
  answered.question.answered_by.push_back(noted_worker(by));
  ledger_.draw(key, std::move(answered.question), std::move(answered.asked));
}

/// Nobody is asked for it any more.
void Workforce::give_up(protocol::RolloutKey key) {
  definitions_.release(policy_name(close(key).question.policy_id));
}

/// One more answer: compared, and forgotten. Nothing is learnt from it.
Rechecks::News Workforce::take_second(Ledger::Entry answered, const AcceptedResult& result) {
  const protocol::RolloutKey key = result.key;
  Rechecks::News news;
  if (result.outcome.is_discarded()) {  // of the policy it says nothing
    rechecks_.drop(key);
  } else {
    news = rechecks_.take(key, {noted_worker(result.worker_id), result.outcome});
  }
  ledger_.counters.conflicting +=
      std::ranges::count_if(news.disagreements, [](const auto& disagreement) {
        return is_one_class(disagreement.first, disagreement.second);
      });
  if (news.wants_another) {
    ask_one_more(key, std::move(answered), result.worker_id);
  } else {
    definitions_.release(policy_name(answered.question.policy_id));
  }
  return news;
}

void Workforce::tell(const Turn& turn, const Rechecks::News& news, protocol::RolloutKey key) {
  const auto is_outvoted = [&](const Opinion& one) {
    return std::ranges::find(news.outvoted, one.worker) != news.outvoted.end();
  };
  for (const auto& [earlier, later] : news.disagreements) {
    if (is_outvoted(earlier) || is_outvoted(later)) continue;  // what follows says who is broken
    turn.warn(kRecheckKind,
              fmt::format("run {} roll-out {}: {}, {}: {}", key.run, key.number, rewarded(earlier),
                          rewarded(later),
                          is_one_class(earlier, later)
                              ? "one of two workers of the same numeric class is broken"
                              : "they are not of one numeric class"));
  }
  const auto is_proven = [this](const KnownWorker& one) {
    return has_proved_itself(one.worker_id);
  };
  const bool is_by_proven = std::ranges::all_of(news.others, is_proven);
  for (const KnownWorker& outvoted : news.outvoted) set_aside(turn, outvoted, is_by_proven, key);
}

/// Has answered something else before.
bool Workforce::has_proved_itself(protocol::WorkerId id) const {
  const auto found = workers_.all().find(id);
  return found != workers_.all().end() && found->second.num_accepted > 1;
}

/// Two others of its class agree on another answer. Who has a key is asked nothing more by this
/// study. In another one's name anybody may have spoken, and two others cost nothing to make up: it
/// is left out for a while, no longer for being so already, and by those who have worked.
void Workforce::set_aside(const Turn& turn, const KnownWorker& outvoted, bool is_by_proven,
                          protocol::RolloutKey key) {
  WorkerEntry* worker = workers_.find(outvoted.worker_id);
  std::string what =
      "its results go to suspects.csv at the end (treeroll-replay --without-worker folds without "
      "them)";
  if (worker != nullptr && worker->is_known) {
    worker->set_aside = true;
    ledger_.take_back_all(worker->id);
    what = "it gets no more work of this study, and " + what;
  } else if (worker != nullptr && is_by_proven && !worker->distrusted) {
    leave_out(turn, *worker, kLeftOutLasts);
    what = fmt::format("it gets no work for {:.0f} s, and {}", to_seconds(kLeftOutLasts), what);
  }
  turn.write({LogLine::Level::kError, kSetAsideKind,
              fmt::format("{}: two others contradict its answer to run {} roll-out {}: {}",
                          described(outvoted), key.run, key.number, what)});
}

bool Workforce::awaits_second_answers(TimePoint now) const {
  return std::ranges::any_of(rechecks_.waiting(), [&](protocol::RolloutKey key) {
    const Ledger::Entry& entry = *ledger_.find(key);
    if (!entry.leases.empty()) return true;
    const TaskDescription* facts = facts_of(entry.question.task_id);
    if (facts == nullptr || !may_run_again(*facts)) return false;
    return std::ranges::any_of(workers_.all(), [&](const auto& each) {
      const WorkerEntry& worker = each.second;
      return worker.usable() && worker.is_alive(now) && worker.may_have(entry.question);
    });
  });
}

}  // namespace treeroll::learner
