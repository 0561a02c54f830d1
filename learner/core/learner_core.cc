#include "learner/core/learner_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/timings.h"

namespace treeroll::learner {
namespace {

/// How long roll-outs under way are waited for when the learner is asked to stop.
constexpr Duration kStopGrace = std::chrono::seconds(5);

/// Thousands of runs must not crowd out roll-outs, nor overrun a watcher's buffer: of runs so much
/// is told in each of these periods, counted as it fills a receiver's buffer, and exceeded by one
/// run's messages at most.
constexpr Duration kNewsPeriod = std::chrono::milliseconds(100);
constexpr std::size_t kNewsBytes = 12 * 1024;
/// Whoever has come late, or lost a message, hears of each run again after so many statuses of the
/// learner, or, of very many, as soon as the bytes allow.
constexpr int kStatusesPerRepetition = 4;
/// Thousands of workers join at once; a status says how many, and their heartbeats stretch.
constexpr Duration kGrowthPause = std::chrono::milliseconds(50);

LearnerSettings with_class(LearnerSettings settings, const std::string& numeric_class) {
  settings.numeric_class = numeric_class;
  return settings;
}

/// @param run_then  the number that its run had; nothing: as now
bool answers(const AcceptedResult& result, std::optional<std::int32_t> run_then,
             const Question& question) {
  const std::int64_t asked =
      run_then ? content_under(question, {*run_then, result.key.number}) : question.content;
  return asked == result.content;
}

/// Nothing has come for so long: what was to be run again stays without an answer.
constexpr Duration kSecondAnswerPatience = std::chrono::seconds(10);

}  // namespace

LearnerCore::LearnerCore(Study study, LearnerSettings settings)
    : study_(std::move(study)),
      learner_id_(settings.learner_id),
      host_(settings.host),
      pid_(settings.pid),
      on_applied_(settings.on_applied),
      is_authenticated_(settings.is_authenticated),
      workforce_(with_class(std::move(settings), study_.numeric_class), *this) {
  for (const Condition& condition : study_.conditions) {
    task_ids_.push_back(workforce_.add_task(condition.task_content));
  }
  policy_ids_.resize(study_.num_runs());
  runs_.reserve(study_.num_runs());
  for (const Condition& condition : study_.conditions) {
    const auto first = explore::first_start(condition.exploration, *condition.start);
    for (int repetition = 0; repetition < study_.repetitions; ++repetition) {
      runs_.emplace_back(study_, static_cast<int>(runs_.size()), first);
    }
  }
}

void LearnerCore::step(TimePoint now, const Event& event, Effects& effects) {
  const bool last_words =
      std::holds_alternative<SyncBegun>(event) || std::holds_alternative<JournalSynced>(event);
  // A journal goes on behind the last result: what was run again was answered yet.
  const bool is_behind_the_end =
      outcome_ == Outcome::kDone && (std::holds_alternative<SecondRecovered>(event) ||
                                     std::holds_alternative<WorkerRecovered>(event) ||
                                     std::holds_alternative<SignalsRecovered>(event));
  if (outcome_ != Outcome::kRunning && !last_words && !is_behind_the_end) return;
  const Turn turn{now, effects, log_limiter_};
  std::visit([&](const auto& what) { on(turn, what); }, event);
  if (outcome_ != Outcome::kRunning) turn.log_rest();
}

TimePoint LearnerCore::next_deadline() const {
  TimePoint next = has_news() ? std::min(next_news_, next_status_) : next_status_;
  if (const auto workforce = workforce_.next_deadline()) next = std::min(next, *workforce);
  if (stop_at_) next = std::min(next, *stop_at_);
  if (const auto end = time_end()) next = std::min(next, *end);
  if (!at_switch_.empty()) next = std::min(next, at_switch_since_);
  return next;
}

void LearnerCore::on(const Turn& turn, const Started&) {
  started_at_ = turn.now;
  next_status_ = turn.now;
  workforce_.start(turn);
  for (Run& run : runs_) draw(turn, run);
}

/// What an earlier incarnation accepted is accepted again, if it answers what is asked now.
void LearnerCore::on(const Turn& turn, const ResultRecovered& event) {
  const AcceptedResult& result = event.result;
  const Ledger::Entry* open = ledger().find(result.key);
  if (!asks(event)) {
    if (event.may_be_superseded) return;
    return fail(fmt::format(
        "the journal answers run {} roll-out {}, which this study {}", result.key.run,
        result.key.number,
        is_unanswered(result.key) ? "draws with other numbers" : "does not ask for at this place"));
  }
  const TaskDescription* facts = workforce_.facts_of(open->question.task_id);
  if (facts && result.outcome.is_ok() && !facts->is_in_range(result.outcome.reward())) {
    return fail(fmt::format(
        "the journal gives run {} roll-out {} reward {}, outside the task's range {} to {}",
        result.key.run, result.key.number, result.outcome.reward(), facts->reward_min,
        facts->reward_max));
  }
  workforce_.recover(turn, result);
}

bool LearnerCore::is_unanswered(protocol::RolloutKey key) const {
  const Ledger::Entry* open = ledger().find(key);
  return open && !open->question.is_run_again();
}

bool LearnerCore::asks(const ResultRecovered& event) const {
  const protocol::RolloutKey key = event.result.key;
  return is_unanswered(key) && answers(event.result, event.run_then, ledger().find(key)->question);
}

bool LearnerCore::asks(const SecondRecovered& event) const {
  const AcceptedResult& result = event.answer.result;
  const Ledger::Entry* open = ledger().find(result.key);
  return open && open->question.is_run_again() && answers(result, event.run_then, open->question) &&
         !open->question.was_answered_by(result.worker_id);
}

/// Of what is waited for no more nothing is left to compare with: that it has an answer must do.
void LearnerCore::on(const Turn&, const SecondRecovered& event) {
  if (asks(event)) return workforce_.recover(event.answer);
  const protocol::RolloutKey key = event.answer.result.key;
  const Ledger::Entry* open = ledger().find(key);
  const bool is_given_up = !open && task_of(key) && answer_of(key);
  if (is_given_up || event.may_be_superseded) return;
  fail(fmt::format("the journal answers run {} roll-out {} once more, which this study {}", key.run,
                   key.number, open ? "asks otherwise" : "does not run again at this place"));
}

void LearnerCore::on(const Turn&, const WorkerRecovered& event) {
  workforce_.recover(event.worker);
}

void LearnerCore::on(const Turn&, const SignalsRecovered& event) {
  const auto& [task_id, names] = event.signals;
  for (std::size_t c = 0; c < study_.conditions.size(); ++c) {
    if (task_ids_[c] != task_id) continue;
    const Policy& start = *study_.conditions[c].start;
    auto fault = treeroll::fault_of(names, start.input_dim(), start.output_dim());
    const TaskDescription* facts = workforce_.facts_of(task_id);
    if (!fault && facts) fault = difference(names, "those of this task are", facts->signals);
    if (!fault) return workforce_.recover(event.signals);
    return fail(fmt::format("the journal names the signals of a task otherwise: {}", *fault));
  }
  fail("the journal names the signals of a task that this study does not have");
}

void LearnerCore::on(const Turn& turn, const MessageReceived& event) {
  workforce_.receive(turn, event.message);
  if (workforce_.has_grown()) next_status_ = std::min(next_status_, turn.now + kGrowthPause);
  finish_if_learnt(turn);
  finish_if_stopped(turn);
}

void LearnerCore::on(const Turn& turn, const InboxDrained&) { workforce_.dispatch(turn); }

void LearnerCore::on(const Turn& turn, const TimerFired&) {
  CHECK(at_work_since_.has_value(), "the recovery is to be finished before the first timer");
  if (!at_switch_.empty()) make_next_switch(turn);
  const bool status_is_due = turn.now >= next_status_;
  if (const auto end = time_end(); end && (turn.now >= *end || status_is_due)) read_clock(turn);
  workforce_.look_after_leases(turn);
  if (status_is_due) {
    workforce_.remind(turn);
    publish_status(turn);
    turn.log_due();
    next_status_ = turn.now + protocol::kLearnerStatusPeriod;
    const int num_runs = static_cast<int>(runs_.size());
    const int num_due = (num_runs + kStatusesPerRepetition - 1) / kStatusesPerRepetition;
    num_to_repeat_ = std::min(num_to_repeat_ + num_due, num_runs);
  }
  if (has_news() && turn.now >= next_news_) {
    publish_news(turn, kNewsBytes);
    next_news_ = turn.now + kNewsPeriod;
  }
  finish_if_learnt(turn);
  finish_if_stopped(turn);
  workforce_.dispatch(turn);
}

void LearnerCore::on(const Turn&, const SyncBegun&) { workforce_.begin_sync(); }

void LearnerCore::on(const Turn& turn, const JournalSynced&) {
  workforce_.end_sync(turn.now);
  workforce_.dispatch(turn);
}

void LearnerCore::on(const Turn& turn, const StopRequested&) {
  stop_at_ = stop_at_ ? turn.now : turn.now + kStopGrace;
  workforce_.give_out_no_more();
  finish_if_learnt(turn);  // perhaps only second answers were waited for
  finish_if_stopped(turn);
}

void LearnerCore::end(Outcome outcome) {
  outcome_ = outcome;
  workforce_.give_out_no_more();
}

void LearnerCore::fail(std::string why) {
  failure_ = std::move(why);
  end(Outcome::kFailed);
}

void LearnerCore::finish_if_stopped(const Turn& turn) {
  if (!stop_at_ || outcome_ != Outcome::kRunning) return;
  if (ledger().num_leased() > 0 && turn.now < *stop_at_) return;
  // The results are those of the journal: who folds it makes each switch at once.
  while (!at_switch_.empty()) make_next_switch(turn);
  read_clock(turn);
  publish_last_words(turn);
  end(Outcome::kStopped);
}

/// What is run again is waited for, while somebody may answer it: nothing follows from it but a
/// word on who is to be believed.
void LearnerCore::finish_if_learnt(const Turn& turn) {
  if (!is_learnt() || outcome_ != Outcome::kRunning) return;
  const Duration patience = std::max(kSecondAnswerPatience, workforce_.patience());
  const bool is_waited_for = !stop_at_ && turn.now < workforce_.last_progress() + patience;
  if (is_waited_for && workforce_.awaits_second_answers(turn.now)) return;
  publish_last_words(turn);
  end(Outcome::kDone);
}

std::optional<ContentHash> LearnerCore::task_of(protocol::RolloutKey key) const {
  if (key.run < 0 || key.run >= static_cast<int>(runs_.size())) return std::nullopt;
  return task_ids_[runs_[key.run].condition()];
}

std::optional<Answer> LearnerCore::answer_of(protocol::RolloutKey key) const {
  return runs_[key.run].answer_of(key.number);
}

bool LearnerCore::is_rechecked(protocol::RolloutKey key) const {
  return learner::is_rechecked(study_, runs_[key.run].repetition(), key.number);
}

void LearnerCore::take(const Turn& turn, const AcceptedResult& result, int numeric_class) {
  Run& run = runs_[result.key.run];
  if (!result.outcome.is_ok()) note_failure(turn, run, result);
  const bool was_at_switch = run.is_at_switch();
  advance(turn, run, [&](const std::function<void(int)>& on_applied) {
    const int applied =
        run.accept_to_switch(result.key.number, result.outcome, numeric_class, on_applied);
    if (result.key.number < 0 && run.answer_of(result.key.number)) ++num_evaluated_;
    return applied;
  });
  if (was_at_switch || !run.is_at_switch()) return;
  at_switch_.push_back(run.index());
  at_switch_since_ = turn.now;
  // What a journal holds next answers the layer that follows.
  while (!at_work_since_ && !at_switch_.empty()) make_next_switch(turn);
}

std::optional<std::string> LearnerCore::fault_of(const ContentHash& task_id,
                                                 const TaskDescription& facts) const {
  for (std::size_t c = 0; c < study_.conditions.size(); ++c) {
    if (task_ids_[c] != task_id) continue;
    const Condition& condition = study_.conditions[c];
    const Policy& policy = *condition.start;
    if (policy.input_dim() != facts.input_dim || policy.output_dim() != facts.output_dim) {
      return fmt::format(
          "condition {}: the task takes {} inputs and {} outputs, the policy has {} and {}",
          condition.name, facts.input_dim, facts.output_dim, policy.input_dim(),
          policy.output_dim());
    }
    if (const auto other =
            difference(facts.signals, "those of the policy are", condition.signals)) {
      return fmt::format("condition {}: the task's {}", condition.name, *other);
    }
  }
  return std::nullopt;
}

/// Without keys anybody may say what a task is: a word that does not fit is its sender's trouble.
std::optional<std::string> LearnerCore::take_facts(const Turn&, const ContentHash& task_id,
                                                   const TaskDescription& facts) {
  const std::optional<std::string> fault = fault_of(task_id, facts);
  if (fault && is_authenticated_) fail(*fault);
  return fault;
}

void LearnerCore::take_signals(const TaskSignals& signals) {
  for (std::size_t c = 0; c < study_.conditions.size(); ++c) {
    if (task_ids_[c] == signals.task_id) study_.conditions[c].signals = signals.names;
  }
}

void LearnerCore::draw(const Turn& turn, Run& run) {
  for (explore::Draw& draw : run.take_draws()) {
    std::map<int, ContentHash>& ids = policy_ids_[run.index()];
    if (!ids.contains(draw.layer)) {
      ids[draw.layer] = workforce_.add_policy(turn, to_json(run.exploration().policy(draw.layer)));
    }
    const protocol::RolloutKey key{run.index(), draw.rollout};
    Question question;
    question.task_id = task_ids_[run.condition()];
    question.policy_id = ids[draw.layer];
    question.theta = std::move(draw.theta);
    for (int trial = 0; trial <= run.num_discards(draw.rollout); ++trial) {
      if (trial > 0) question.discarded.push_back(question.content);
      question.task_seed = task_seed(study_, run.repetition(), draw.rollout, trial);
      seal(question, key);
    }
    workforce_.ask(key, std::move(question));
  }
}

/// Once: when the last run has all its roll-outs.
void LearnerCore::tell_of_final_evaluations(const Turn& turn, const Run& run) {
  if (told_of_final_evaluations_ || !run.exploration().done()) return;
  const auto has_all = [](const Run& each) { return each.exploration().done(); };
  if (!std::all_of(runs_.begin(), runs_.end(), has_all)) return;
  told_of_final_evaluations_ = true;
  turn.inform("final evaluations",
              "all roll-outs are in; what remains is to evaluate the policies they have led to");
}

void LearnerCore::finish_run(const Turn& turn, Run& run) {
  for (const auto& [layer, id] : policy_ids_[run.index()]) workforce_.release_policy(id);
  policy_ids_[run.index()].clear();
  ++num_done_;
  say_if_start_is_not_beaten(turn, run);
  // Of a journal nothing is run again; what it holds of that follows.
  if (!is_learnt() || (at_work_since_ && study_.recheck > 0)) return;
  publish_last_words(turn);
  end(Outcome::kDone);
}

LedgerCounters LearnerCore::counters() const {
  LedgerCounters counters = ledger().counters;
  counters.applied = num_applied_;
  for (const Run& run : runs_) {
    counters.failed += run.num_failed();
    counters.discarded += run.num_discarded();
  }
  counters.pending = counters.issued - counters.applied;
  return counters;
}

std::vector<RunRecord> LearnerCore::run_records() const& {
  std::vector<RunRecord> records;
  records.reserve(runs_.size());
  for (const Run& run : runs_) records.push_back(run.record());
  return records;
}

std::vector<RunRecord> LearnerCore::run_records() && {
  std::vector<RunRecord> records;
  records.reserve(runs_.size());
  for (Run& run : runs_) records.push_back(std::move(run).record());
  return records;
}

std::map<std::string, bool> LearnerCore::determinism() const {
  std::map<std::string, bool> known;
  for (std::size_t c = 0; c < study_.conditions.size(); ++c) {
    const TaskDescription* facts = workforce_.facts_of(task_ids_[c]);
    if (facts) known[study_.conditions[c].name] = facts->deterministic;
  }
  return known;
}

}  // namespace treeroll::learner
