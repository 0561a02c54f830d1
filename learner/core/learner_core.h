#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/log_limiter.h"
#include "common/base/time.h"
#include "learner/core/learner_events.h"
#include "learner/core/learner_settings.h"
#include "learner/core/run.h"
#include "learner/core/study.h"
#include "learner/core/workforce.h"

namespace treeroll::learner {

/// What is learnt, as a pure state machine: many runs side by side over one workforce. No clock,
/// no network, no threads: a function of its study, settings and events.
///
///   LearnerCore core(study, settings);
///   core.step(now, Started{}, effects);
///   ... what is recovered, for each record of a journal, then
///   core.step(now, RecoveryFinished{}, effects);
///   ... for each event, and TimerFired at core.next_deadline():
///   core.step(now, event, effects);  // carry_out() and clear the effects
class LearnerCore : private Client {
 public:
  enum class Outcome {
    kRunning,
    kDone,     ///< every run has come to its end and has its final evaluation
    kStopped,  ///< on request: it can be resumed
    kFailed,   ///< the study cannot be learnt; failure() says why
  };

  /// Precondition: the study has conditions and its numbers are in bounds (learner/app checks).
  LearnerCore(Study study, LearnerSettings settings);
  LearnerCore(const LearnerCore&) = delete;  // runs point at the study, the workforce at us
  LearnerCore& operator=(const LearnerCore&) = delete;

  /// Appends to `effects`. Time must not go backwards.
  void step(TimePoint now, const Event& event, Effects& effects);
  /// When TimerFired is due unless an event comes before.
  TimePoint next_deadline() const;

  Outcome outcome() const { return outcome_; }
  const std::string& failure() const { return failure_; }
  /// The study has had its time (study.stop_after_s): runs draw nothing more.
  bool time_is_up() const { return time_is_up_; }

  /// Whether this roll-out is asked for and has no answer yet.
  bool is_unanswered(protocol::RolloutKey key) const;
  /// Whether this result answers what is asked now, for the first time.
  bool asks(const ResultRecovered& event) const;
  /// Whether this one answers what is run again now, and its worker has not answered before.
  bool asks(const SecondRecovered& event) const;

  const Study& study() const { return study_; }
  LedgerCounters counters() const;
  /// What watchers are told once a second.
  protocol::LearnerStatus status(TimePoint now) const;
  const Ledger& ledger() const { return workforce_.ledger(); }
  const Workforce& workforce() const { return workforce_; }
  const std::vector<Run>& runs() const { return runs_; }
  std::vector<RunRecord> run_records() const&;
  /// The same at the end, without a copy of the roll-outs: the core is asked for no answer any
  /// more.
  std::vector<RunRecord> run_records() &&;
  /// Accepted results by the numeric class of their workers, as far as it is known.
  const std::map<std::string, std::int64_t>& results_by_class() const {
    return workforce_.classes().counts();
  }
  /// By condition whose task has been described: whether it is deterministic.
  std::map<std::string, bool> determinism() const;
  std::vector<WorkerRecord> worker_records() const {
    return workforce_.workers().records(started_at_);
  }

 private:
  // learner_core.cc: what happens.
  void on(const Turn& turn, const Started& event);
  void on(const Turn& turn, const ResultRecovered& event);
  void on(const Turn& turn, const SecondRecovered& event);
  void on(const Turn& turn, const WorkerRecovered& event);
  void on(const Turn& turn, const SignalsRecovered& event);
  void on(const Turn& turn, const MessageReceived& event);
  void on(const Turn& turn, const InboxDrained& event);
  void on(const Turn& turn, const TimerFired& event);
  void on(const Turn& turn, const SyncBegun& event);
  void on(const Turn& turn, const JournalSynced& event);
  void on(const Turn& turn, const StopRequested& event);
  void end(Outcome outcome);
  void fail(std::string why);
  void finish_if_stopped(const Turn& turn);
  void finish_if_learnt(const Turn& turn);
  bool is_learnt() const { return num_done_ == static_cast<int>(runs_.size()); }

  std::optional<ContentHash> task_of(protocol::RolloutKey key) const override;
  std::optional<Answer> answer_of(protocol::RolloutKey key) const override;
  bool is_rechecked(protocol::RolloutKey key) const override;
  void take(const Turn& turn, const AcceptedResult& result, int numeric_class) override;
  std::optional<std::string> fault_of(const ContentHash& task_id,
                                      const TaskDescription& facts) const override;
  std::optional<std::string> take_facts(const Turn& turn, const ContentHash& task_id,
                                        const TaskDescription& facts) override;
  void take_signals(const TaskSignals& signals) override;

  void make_next_switch(const Turn& turn);
  /// Of a result or a switch.
  /// @param step  what is done with the run, given what to call for each result that it applies;
  ///              gives how many
  void advance(const Turn& turn, Run& run,
               const std::function<int(const std::function<void(int)>&)>& step);
  void draw(const Turn& turn, Run& run);
  void tell_of_final_evaluations(const Turn& turn, const Run& run);
  void tell_of_switches(const Turn& turn, const Run& run, std::size_t from) const;
  void finish_run(const Turn& turn, Run& run);
  void note_failure(const Turn& turn, const Run& run, const AcceptedResult& result);
  void say_if_start_is_not_beaten(const Turn& turn, const Run& run) const;

  // learner_core_time.cc: how long it has been.
  void on(const Turn& turn, const TimeRecovered& event);
  void on(const Turn& turn, const RecoveryFinished& event);
  std::optional<TimePoint> time_end() const;
  void read_clock(const Turn& turn);
  void pass_time(const Turn& turn, const LearningTime& time);

  // progress.cc: what watchers are told.
  void publish_status(const Turn& turn);
  void publish_news(const Turn& turn, std::size_t bytes_max);
  std::size_t publish_run(const Turn& turn, int run, bool repeats);
  std::size_t publish_best(const Turn& turn, int run);
  void publish_last_words(const Turn& turn);
  bool has_news() const { return !changed_runs_.empty() || num_to_repeat_ > 0; }

  Study study_;
  protocol::LearnerId learner_id_;
  std::string host_;
  std::int32_t pid_ = 0;
  Outcome outcome_ = Outcome::kRunning;
  std::string failure_;
  std::function<void(const Run&, int)> on_applied_;
  bool is_authenticated_ = false;

  Workforce workforce_;
  std::vector<Run> runs_;
  std::vector<std::map<int, ContentHash>> policy_ids_;  // by run, then layer
  std::vector<ContentHash> task_ids_;                   // by condition

  std::deque<int> at_switch_;    // runs whose next layer's start is to be computed
  TimePoint at_switch_since_{};  // of the last of them
  int num_done_ = 0;
  std::int64_t num_applied_ = 0;      // of all runs' roll-outs
  std::int64_t num_evaluated_ = 0;    // outside the budget
  std::optional<TimePoint> stop_at_;  // stopping, no later than this
  TimePoint started_at_;
  bool told_of_final_evaluations_ = false;
  std::optional<TimePoint> at_work_since_;  // of this incarnation, its recovery behind it
  LearningTime learnt_;                     // as the journal has it
  Duration learnt_before_{};                // by earlier incarnations
  bool time_is_up_ = false;                 // by the journal
  TimePoint next_status_;
  std::set<int> changed_runs_;  // since their last status message
  TimePoint next_news_;
  int last_changed_run_ = -1;  // whose turn it was
  int num_to_repeat_ = 0;      // runs
  int next_repeated_run_ = 0;
  std::map<int, double> announced_best_;
  std::string last_failure_;  // in words; empty: none
  LogLimiter log_limiter_;
};

}  // namespace treeroll::learner
