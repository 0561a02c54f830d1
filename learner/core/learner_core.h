#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/base/log_limiter.h"
#include "common/base/task_description.h"
#include "common/base/time.h"
#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "learner/core/accepted_result.h"
#include "learner/core/definition_book.h"
#include "learner/core/learning_time.h"
#include "learner/core/ledger.h"
#include "learner/core/run.h"
#include "learner/core/study.h"
#include "learner/core/worker_table.h"

namespace treeroll {

/// What happens to the learner.
namespace learner_event {
struct Started {};
struct Received {
  const protocol::Message* message;
};
struct InboxDrained {};  ///< no more messages are waiting: time to answer
struct Timer {};         ///< next_deadline() has come
/// The journal has everything that was accepted before this event on stable storage.
struct Synced {};
/// A result that an earlier incarnation accepted, in its order; after Started, before all others.
struct Recovered {
  const AcceptedResult* result;
};
/// The same of the time it had counted.
struct TimeRecovered {
  LearningTime time;
};
struct StopRequested {};  ///< no more roll-outs; the outcome follows once those under way are in
}  // namespace learner_event
using LearnerEvent =
    std::variant<learner_event::Started, learner_event::Received, learner_event::InboxDrained,
                 learner_event::Timer, learner_event::Synced, learner_event::Recovered,
                 learner_event::TimeRecovered, learner_event::StopRequested>;

/// What the learner wants done, in this order: to the journal (results, then the time if it is to
/// be noted), sent, logged.
struct LearnerEffects {
  std::vector<AcceptedResult> accepted;
  std::optional<LearningTime> time;
  std::vector<protocol::Message> send;
  std::vector<LogLine> log;
};

struct LearnerSettings {
  protocol::LearnerId learner_id = 0;
  std::size_t batch_bytes_max = 0;  ///< of one roll-out batch that holds more than one roll-out
  /// Descriptions known beforehand, by task content; the others are asked of the workers.
  std::map<std::string, TaskDescription> known_tasks;
  /// Accepted results that may wait for Synced; past it nothing is accepted or given out.
  std::int64_t unsynced_results_max = protocol::kUnsyncedResultsMax;
};

/// The learner as a pure state machine: many runs side by side over one pool of workers. No clock,
/// no network, no threads: a function of its study, settings and events.
class LearnerCore {
 public:
  enum class Outcome {
    kRunning,
    kDone,     ///< every run has come to its end and has its final evaluation
    kStopped,  ///< on request: it can be resumed
    kFailed,   ///< the study cannot be learnt; failure() says why
  };

  /// Precondition: the study has conditions and its numbers are in bounds (learner/app checks).
  LearnerCore(Study study, LearnerSettings settings);
  LearnerCore(const LearnerCore&) = delete;  // runs point at the study
  LearnerCore& operator=(const LearnerCore&) = delete;

  void step(TimePoint now, const LearnerEvent& event, LearnerEffects& effects);
  TimePoint next_deadline() const;

  Outcome outcome() const { return outcome_; }
  const std::string& failure() const { return failure_; }

  const Study& study() const { return study_; }
  LedgerCounters counters() const;
  const Ledger& ledger() const { return ledger_; }
  std::vector<RunRecord> run_records() const;
  std::vector<WorkerRecord> worker_records() const { return workers_.records(started_at_); }

 private:
  // learner_core.cc: what happens.
  void on_started(TimePoint now, LearnerEffects& effects);
  void on_timer(TimePoint now, LearnerEffects& effects);
  void on_synced(TimePoint now, LearnerEffects& effects);
  void on_stop(TimePoint now, LearnerEffects& effects);
  WorkerEntry* hear(protocol::WorkerId id, TimePoint now, LearnerEffects& effects);
  bool journal_is_behind() const { return num_unsynced_ >= settings_.unsynced_results_max; }
  void finish_if_stopped(TimePoint now, LearnerEffects& effects);
  void recover(const AcceptedResult& result, TimePoint now, LearnerEffects& effects);
  void on_message(const protocol::RewardBatch& batch, TimePoint now, LearnerEffects& effects);
  void on_message(const protocol::WorkerStatus& status, TimePoint now, LearnerEffects& effects);
  void on_message(const protocol::DefinitionRequest& request, TimePoint now,
                  LearnerEffects& effects);
  void on_message(const protocol::DefinitionReport& report, TimePoint now, LearnerEffects& effects);

  // learner_core_time.cc: how long it has been.
  std::optional<TimePoint> time_end() const;
  void read_clock(TimePoint now, LearnerEffects& effects);
  void pass_time(const LearningTime& time, TimePoint now, LearnerEffects& effects);
  void recover(const LearningTime& time, TimePoint now, LearnerEffects& effects);
  // learner_core_answers.cc: what answers do.
  void accept(WorkerEntry& worker, const protocol::RolloutResult& result, TimePoint now,
              LearnerEffects& effects);
  const TaskDescription* facts_of(int run) const;
  void compare_with_accepted(const WorkerEntry& worker, const protocol::RolloutResult& result,
                             const TaskDescription& facts, TimePoint now, LearnerEffects& effects);
  void distrust(WorkerEntry& worker, const protocol::RolloutResult& result,
                const TaskDescription& facts, TimePoint now, LearnerEffects& effects);
  void learn(const AcceptedResult& result, int numeric_class, TimePoint now,
             LearnerEffects& effects);
  void note_timing(WorkerEntry& worker, const protocol::RolloutResult& result,
                   const Ledger::Entry& entry, TimePoint now);
  bool answers_open_question(const protocol::RolloutResult& result) const;
  void extend_leases(WorkerEntry& worker, const std::vector<protocol::RolloutKey>& held,
                     TimePoint now);
  void reconcile(WorkerEntry& worker, std::int64_t last_batch,
                 const std::vector<protocol::RolloutKey>& held, TimePoint now);
  void take_back(WorkerEntry& worker, protocol::RolloutKey key);
  void draw(Run& run, TimePoint now, LearnerEffects& effects);
  void finish_run(Run& run, LearnerEffects& effects);
  // learner_core.cc: what goes out.
  void dispatch(TimePoint now, LearnerEffects& effects);
  void publish_task(const ContentHash& id, TimePoint now, LearnerEffects& effects);
  void publish_policy(const ContentHash& id, TimePoint now, LearnerEffects& effects);
  // progress.cc: what watchers are told.
  void log(TimePoint now, LogLine line, LearnerEffects& effects);
  void publish_status(TimePoint now, LearnerEffects& effects);
  void publish_run(int run, LearnerEffects& effects);
  void learn_facts(const ContentHash& task_id, const TaskDescription& facts);
  void refuse(WorkerEntry& worker, const ContentHash& definition, const std::string& reason,
              TimePoint now, LearnerEffects& effects);
  /// Of a result whose worker was another incarnation's, or of one class too many: it compares with
  /// nothing.
  static constexpr int kUnknownClass = -1;
  int numeric_class(const std::string& name);
  std::optional<std::string> refused_by_all(const ContentHash& definition) const;
  std::string why_waiting(TimePoint now) const;  // progress.cc

  Study study_;
  LearnerSettings settings_;
  Outcome outcome_ = Outcome::kRunning;
  std::string failure_;

  std::vector<Run> runs_;
  std::vector<std::map<int, ContentHash>> policy_ids_;  // by run, then layer
  std::vector<ContentHash> task_ids_;                   // by condition
  std::map<ContentHash, TaskDescription> facts_;
  DefinitionBook tasks_;
  DefinitionBook policies_;
  Ledger ledger_;
  WorkerTable workers_;
  std::set<protocol::WorkerId> answers_unsynced_;      // have answered what is not yet synced
  std::set<protocol::WorkerId> acknowledgements_due_;  // with the next message
  std::map<std::string, int> numeric_classes_;

  std::int64_t last_batch_ = 0;    // sequence of the last message sent
  double rollout_time_s_ = 0;      // running mean over all answers
  std::int64_t num_unsynced_ = 0;  // accepted, and perhaps not on stable storage
  bool refuses_workers_ = false;   // has said so, since there was room for one
  int num_done_ = 0;
  std::int64_t num_rollouts_ = 0;     // of all runs
  std::optional<TimePoint> stop_at_;  // stopping, no later than this
  TimePoint started_at_;
  std::optional<TimePoint> at_work_since_;  // of this incarnation, its recovery behind it
  LearningTime learnt_;                     // as the journal has it
  Duration learnt_before_{};                // by earlier incarnations
  bool time_is_up_ = false;                 // by the journal
  TimePoint next_status_;
  TimePoint last_progress_;     // a result was accepted
  std::set<int> changed_runs_;  // since their last status message
  int last_status_run_ = -1;
  std::map<int, double> announced_best_;
  LogLimiter log_limiter_;
};

}  // namespace treeroll
