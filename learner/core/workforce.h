#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/task_facts/task_description.h"
#include "learner/core/answer.h"
#include "learner/core/definition_book.h"
#include "learner/core/learner_events.h"
#include "learner/core/learner_settings.h"
#include "learner/core/ledger.h"
#include "learner/core/numeric_classes.h"
#include "learner/core/rechecks.h"
#include "learner/core/task_accounts.h"
#include "learner/core/worker_table.h"

namespace treeroll::learner {

/// Whom nobody can prove to have lied gets no work for so long.
inline constexpr Duration kLeftOutLasts = std::chrono::seconds(60);

/// For whom a workforce computes. Called within Workforce::receive().
class Client {
 public:
  virtual ~Client() = default;

  /// The task of this roll-out, which may be of no study at all: nothing then.
  virtual std::optional<ContentHash> task_of(protocol::RolloutKey key) const = 0;
  /// The answer it has already taken to this roll-out, if any.
  virtual std::optional<Answer> answer_of(protocol::RolloutKey key) const = 0;
  /// Whether an answer to this roll-out is to be compared with one of another worker.
  virtual bool is_rechecked(protocol::RolloutKey key) const = 0;
  /// Takes the answer to an open question, which is closed; may ask the next ones.
  virtual void take(const Turn& turn, const AcceptedResult& result, int numeric_class) = 0;
  /// Why the client cannot use a task of this description, if it cannot.
  virtual std::optional<std::string> fault_of(const ContentHash& task_id,
                                              const TaskDescription& facts) const = 0;
  /// A worker has described a task, or most of them describe it otherwise now, or the first
  /// names its signals. @return fault_of() it
  virtual std::optional<std::string> take_facts(const Turn& turn, const ContentHash& task_id,
                                                const TaskDescription& facts) = 0;
  /// From now on these are the names of the task's signals: the journal holds them.
  virtual void take_signals(const TaskSignals& signals) = 0;
};

/// Who computes: takes questions, gives them to workers, and gives their answers back, each once.
/// Pure as the core that owns it, and knows nothing of learning.
class Workforce {
 public:
  /// Precondition: `client` outlives the workforce.
  Workforce(LearnerSettings settings, Client& client);

  // What the client wants.

  /// One user more of a definition. Policies are published at once, tasks by start(): their pieces
  /// go out with dispatch().
  ContentHash add_task(const std::string& content);
  ContentHash add_policy(const Turn& turn, const std::string& content);
  void release_policy(const ContentHash& id) { definitions_.release(policy_name(id)); }
  void start(const Turn& turn);
  /// Precondition: the key is not open.
  void ask(protocol::RolloutKey key, Question question) { ledger_.draw(key, std::move(question)); }
  /// The answer is known from elsewhere. Precondition: the question is open.
  void withdraw(protocol::RolloutKey key) { close(key); }
  /// No more roll-outs are given out, for good; answers are still taken.
  void give_out_no_more() { gives_out_ = false; }

  // What happens.

  /// Messages of workers; others are ignored.
  void receive(const Turn& turn, const protocol::Message& message);
  /// Takes back what is with workers that are silent, and what has no word for too long.
  void look_after_leases(const Turn& turn);
  /// Once a second or so: what is forgotten by then, and what is to be asked again.
  void remind(const Turn& turn);
  /// How many workers have joined, to be told to them now.
  int count_workers(TimePoint now);
  /// Far more have joined since they were told: they should hear of it before they are too loud.
  bool has_grown() const;
  /// Only what will survive us may be forgotten by those who have it: what had been accepted when
  /// the sync was begun does once it has ended.
  void begin_sync();
  void end_sync(TimePoint now);
  /// Gives ready roll-outs to workers, acknowledges their answers, and sends definitions.
  void dispatch(const Turn& turn);

  std::optional<TimePoint> next_deadline() const;

  /// Of earlier incarnations: a worker of theirs, a result, one more answer to its question, names
  /// of signals. The client takes the result and the names. Precondition of results: the key is
  /// open; of answers: is_run_again.
  void recover(const KnownWorker& worker);
  void recover(const Turn& turn, const AcceptedResult& result);
  void recover(const SecondAnswer& answer);
  void recover(const TaskSignals& signals);

  // What is known.

  const NumericClasses& classes() const { return classes_; }

  /// What has come of roll-outs that were run again.
  const Rechecks& rechecks() const { return rechecks_; }
  /// Whether one of them has an answer to come: it is out, or somebody may be asked.
  bool awaits_second_answers(TimePoint now) const;

  const Ledger& ledger() const { return ledger_; }
  const WorkerTable& workers() const { return workers_; }
  /// Null while no worker has described the task.
  const TaskDescription* facts_of(const ContentHash& task_id) const;
  /// Why no usable worker takes this definition; nothing if one does.
  std::optional<std::string> refused_by_all(const ContentHash& definition) const;
  /// For how long no answer need come although all is well: by what the tasks in work have taken,
  /// by their limits while that is not known.
  Duration patience() const;
  /// An answer was accepted, or the start.
  TimePoint last_progress() const { return last_progress_; }
  std::int64_t num_unsynced() const { return num_unsynced_; }
  bool journal_is_behind() const { return num_unsynced_ >= settings_.unsynced_results_max; }

 private:
  // workforce.cc: what workers say of themselves, and what is said to them.
  void on(const Turn& turn, const protocol::WorkerStatus& status);
  WorkerEntry* hear(const Turn& turn, protocol::WorkerId id);
  void note_echo(const Turn& turn, WorkerEntry& worker, std::int64_t last_batch);
  void note_lost(TimePoint now, protocol::WorkerId worker, TimePoint issued_at);
  Ledger::Entry close(protocol::RolloutKey key, protocol::WorkerId from = 0);
  void acknowledge(protocol::WorkerId id, TimePoint by);
  std::vector<protocol::Acknowledgement> take_acknowledgements(TimePoint now, bool goes_along);

  // workforce_definitions.cc: what they need to know: tasks, policies, long thetas.
  void on(const Turn& turn, const protocol::DefinitionRequest& request);
  void on(const Turn& turn, const protocol::DefinitionReport& report);
  void refuse(const Turn& turn, WorkerEntry& worker, const ContentHash& definition,
              const std::string& reason);
  static protocol::DefinitionName task_name(const ContentHash& id) {
    return {protocol::DefinitionKind::kTask, id};
  }
  static protocol::DefinitionName policy_name(const ContentHash& id) {
    return {protocol::DefinitionKind::kPolicy, id};
  }
  void send_definitions(const Turn& turn);
  void publish_undescribed_tasks(TimePoint now);
  void detach_theta(TimePoint now, protocol::RolloutRequest& request);

  // workforce_answers.cc: what they answer.
  void on(const Turn& turn, const protocol::RewardBatch& batch);
  // Whether it has been read, each.
  bool accept(const Turn& turn, WorkerEntry& worker, const protocol::RolloutResult& result,
              std::int64_t index);
  bool note_unasked(const Turn& turn, const WorkerEntry& worker);
  bool compare_with_taken(const Turn& turn, const WorkerEntry& worker,
                          const protocol::RolloutResult& result, const TaskDescription& facts);
  void compare_repeated(const Turn& turn, const WorkerEntry& worker,
                        const protocol::RolloutResult& result);
  void note_conflict(const Turn& turn, const WorkerEntry& worker,
                     const protocol::RolloutResult& result, const Answer& before,
                     const TaskDescription& facts);
  void note_timing(TimePoint now, WorkerEntry& worker, const protocol::RolloutResult& result,
                   const Ledger::Entry& entry);
  bool answers_open_question(const protocol::RolloutResult& result,
                             protocol::WorkerId worker) const;
  void note_requests(TimePoint now, WorkerEntry& worker, const protocol::RewardBatch& batch);
  TimePoint lease_end_if_held(TimePoint now, const WorkerEntry& worker) const;
  void confirm(WorkerEntry& worker, protocol::RolloutKey key, TimePoint extended);
  void take_back_lost(TimePoint now, WorkerEntry& worker, protocol::RolloutKey key,
                      bool has_neither);
  void confirm_leases(TimePoint now, WorkerEntry& worker, std::int64_t last_batch,
                      const std::vector<protocol::RolloutKey>& held);
  void reconcile(TimePoint now, WorkerEntry& worker, const protocol::HeldRollouts& held);
  void note_class(const Turn& turn, WorkerEntry& worker);
  void count_class(const Turn& turn, const WorkerEntry& worker);
  KnownWorker noted_worker(protocol::WorkerId id) const;
  void compare_with_demand(const Turn& turn, WorkerEntry& worker);

  // workforce_rechecks.cc: what another worker makes of the same.
  void hand_over(const Turn& turn, Ledger::Entry answered, const AcceptedResult& result,
                 int numeric_class);
  void ask_one_more(protocol::RolloutKey key, Ledger::Entry answered, protocol::WorkerId by);
  Rechecks::News take_second(Ledger::Entry answered, const AcceptedResult& result);
  void give_up(protocol::RolloutKey key);
  void tell(const Turn& turn, const Rechecks::News& news, protocol::RolloutKey key);
  void set_aside(const Turn& turn, const KnownWorker& outvoted, bool is_by_proven,
                 protocol::RolloutKey key);
  bool has_proved_itself(protocol::WorkerId id) const;

  // workforce_trust.cc: whom to believe where nobody signs.
  bool suspect(const Turn& turn, WorkerEntry& worker, const protocol::RolloutResult& result,
               std::int64_t index, const TaskDescription& facts);
  Duration distrust(const Turn& turn, WorkerEntry& worker);
  void leave_out(const Turn& turn, WorkerEntry& worker, Duration lasts);
  void settle_suspicion(const Turn& turn, WorkerEntry& worker, const protocol::HeldRollouts& held);
  void clear_of_suspicion(const Turn& turn, WorkerEntry& worker, const Ledger::Entry& answered,
                          protocol::RolloutKey key);
  bool forget_refusals_of(WorkerEntry& worker, const Question& question);
  void forget_false_refusals(const Turn& turn, WorkerEntry& worker,
                             const protocol::HeldRollouts& held);
  void take_description(const Turn& turn, WorkerEntry& worker, const ContentHash& task,
                        const TaskDescription& said);
  void ask_for_description(const Turn& turn, const WorkerEntry& worker, const ContentHash& task);
  void refuse_description(const Turn& turn, WorkerEntry& worker, const ContentHash& task,
                          const std::string& why);
  void elect_description(const Turn& turn, const ContentHash& task);
  void take_late_names(const Turn& turn, const ContentHash& task, const TaskDescription& said);
  void note_signals(const Turn& turn, const ContentHash& task);

  LearnerSettings settings_;
  Client& client_;
  std::vector<ContentHash> task_ids_;  // as they were added
  std::map<ContentHash, TaskDescription> facts_;
  /// The most of them are believed, until an answer is taken. Nothing of tasks that are known
  /// beforehand.
  TaskAccounts accounts_;
  std::map<ContentHash, SignalNames> noted_signals_;  // as the journal knows them
  DefinitionBook definitions_;
  Ledger ledger_;
  std::map<protocol::RolloutKey, ContentHash> thetas_;  // of open roll-outs, sent in pieces
  WorkerTable workers_;
  std::set<protocol::WorkerId> answers_unsynced_;      // have answered what no sync has begun with
  std::set<protocol::WorkerId> answers_syncing_;       // what the sync under way has
  std::set<protocol::WorkerId> acknowledgements_due_;  // with the next message
  std::optional<TimePoint> acknowledge_by_;            // in a message of their own, if none comes
  std::optional<TimePoint> describe_at_;               // tasks are published for newcomers
  NumericClasses classes_;
  std::map<protocol::WorkerId, KnownWorker> noted_;  // as the journal knows them
  Rechecks rechecks_;
  bool has_told_of_no_rechecks_ = false;
  std::int64_t last_batch_ = 0;                 // sequence of the last message sent
  double rollout_time_s_ = 0;                   // running mean over all answers
  std::map<ContentHash, double> task_times_s_;  // the same, by task
  std::int64_t num_unsynced_ = 0;               // accepted, and perhaps not on stable storage
  std::int64_t num_syncing_ = 0;                // of these, what the sync under way has
  bool gives_out_ = true;
  bool refuses_workers_ = false;  // has said so, since there was room for one
  int num_told_ = 0;              // of workers that have joined
  int num_joined_since_ = 0;
  TimePoint last_progress_;
  TimePoint hedge_at_;  // not before
};

}  // namespace treeroll::learner
