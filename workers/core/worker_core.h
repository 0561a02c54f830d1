#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/log_limiter.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "workers/core/answer_store.h"
#include "workers/core/definition_cache.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// A worker as a pure state machine: which roll-outs it holds, who evaluates them, what it
/// answers and repeats. No clock, no process, no network; the daemon carries out the effects.
///
///   WorkerCore core(settings);
///   core.step(now, Started{}, effects);
///   ... for each event, and TimerFired at core.next_deadline():
///   core.step(now, event, effects);  // carry out and clear the effects, in order
///   ... once the inbox is drained:
///   core.step(now, InboxDrained{}, effects);
class WorkerCore {
 public:
  explicit WorkerCore(WorkerSettings settings);

  /// Appends to `effects`. Time must not go backwards.
  void step(TimePoint now, const Event& event, Effects& effects);

  /// When TimerFired is due unless an event comes before. TimePoint::max() after Exit.
  TimePoint next_deadline() const;

 private:
  struct Turn {
    TimePoint now;
    Effects& effects;
    LogLimiter& limiter;
    /// @param kind  see LogLine
    void log(bool warning, std::string_view kind, std::string text) const;
  };

  /// A link to one learner: what was heard of it and what it must still be told.
  struct Learner {
    TimePoint heard;
    std::int64_t last_batch = 0;
    bool answers_due = false;  ///< a repeated question: send even if nothing is new
    std::int64_t last_sent_index = 0;
    std::optional<TimePoint> repeat_at;
    Duration repeat_interval{};
    int num_hasty = 0;    ///< repetitions without backing off since answers were acknowledged
    bool asking = false;  ///< some roll-out may wait for a definition that is not here
    std::optional<TimePoint> ask_at;
    std::set<DefinitionName> asked;  ///< missing ones asked for less than ask_interval ago
  };

  enum class EvaluatorState { kDown, kStarting, kIdle, kLoading, kRunning };
  struct Evaluator {
    EvaluatorState state = EvaluatorState::kDown;
    bool killed = false;       ///< its death is on its way
    bool timed_out = false;    ///< killed for exceeding a time limit while loading or running
    std::int64_t job = 0;      ///< number of what it loads or runs
    TimePoint since;           ///< of the job or the start
    Duration time_limit{};     ///< of the job, CPU time
    TimePoint busy_at;         ///< last seen to have burnt CPU time on the job, or its begin
    Duration busy_cpu_time{};  ///< what it had burnt by then
    std::optional<TimePoint> look_at;  ///< start time-out, CPU time check, or restart when down
    std::optional<RolloutName> rollout;
    std::int64_t content = 0;  ///< of that roll-out: another one in its place is not this one
    std::optional<DefinitionName> loading;
    std::set<DefinitionName> known;
    std::int64_t num_evicted_seen = 0;
    /// In a row since its last result, not the fault of a roll-out or definition.
    int num_bare_deaths = 0;
  };

  // worker_core.cc: the learners' messages.
  void on(const Turn& turn, const Started& event);
  void on(const Turn& turn, const MessageReceived& event);
  void on(const Turn& turn, const InboxDrained& event);
  void on(const Turn& turn, const TimerFired& event);
  void on(const Turn& turn, const DrainRequested& event);
  Learner* meet(const Turn& turn, protocol::LearnerId id);
  void forget(const Turn& turn, protocol::LearnerId id);
  void receive(const Turn& turn, const protocol::RolloutBatch& batch);
  void take_request(const Turn& turn, protocol::LearnerId learner_id, Learner& learner,
                    std::int64_t sequence, const protocol::RolloutRequest& request);
  void receive_definition(const Turn& turn, protocol::LearnerId learner, const DefinitionName& name,
                          const std::string& content);
  void review(const Turn& turn, const RolloutName& name);
  void review_waiting(const Turn& turn);
  void forget_stale_checks();
  void settle(const Turn& turn, const DefinitionName& name, Definition& definition);
  void report(protocol::LearnerId learner, const ContentHash& id, bool accepted,
              const std::string& text);
  void finish_if_drained(const Turn& turn);
  void exit(const Turn& turn, int status);

  // worker_core_sending.cc: what goes out.
  void send_reports(const Turn& turn);
  void send_answers(const Turn& turn, protocol::LearnerId id, Learner& learner);
  bool in_haste(protocol::LearnerId id, const Learner& learner) const;
  void hurry_if_full(const Turn& turn, protocol::LearnerId id, Learner& learner);
  void back_off(protocol::LearnerId id, Learner& learner) const;
  void ask_for_definitions(const Turn& turn, protocol::LearnerId id, Learner& learner);
  void send_status(const Turn& turn);
  std::size_t num_results_max(std::size_t num_held) const;
  int free_slots() const;
  bool any_living() const;

  // worker_core_evaluators.cc: who computes what.
  void on(const Turn& turn, const EvaluatorReady& event);
  void on(const Turn& turn, const DefinitionLoaded& event);
  void on(const Turn& turn, const RolloutEvaluated& event);
  void on(const Turn& turn, const CpuTimeMeasured& event);
  void on(const Turn& turn, const EvaluatorDied& event);
  void assign_work(const Turn& turn);
  void continue_rollout(const Turn& turn, int index);
  void load(const Turn& turn, int index, const DefinitionName& name);
  void begin_job(const Turn& turn, Evaluator& evaluator, EvaluatorState state, Duration limit);
  void release(Evaluator& evaluator);
  HeldRollout* rollout_of(const Evaluator& evaluator);
  void strike_definition(const Turn& turn, const DefinitionName& name, bool timed_out);
  void strike_rollout(const Turn& turn, const Evaluator& evaluator, bool charged);
  void give_up(const RolloutName& name);
  void give_all_up_in_trouble(const Turn& turn);
  void answer(const Turn& turn, const RolloutName& name, RolloutStatus status, double reward,
              std::int64_t duration_ns);
  void watch_evaluator(const Turn& turn, int index);
  void excuse_delay(TimePoint now);
  bool any_running() const;

  DefinitionCache& cache(DefinitionKind kind);
  std::set<ContentHash> in_use(DefinitionKind kind) const;

  WorkerSettings settings_;
  std::map<protocol::LearnerId, Learner> learners_;
  RolloutQueue queue_;
  AnswerStore answers_;
  DefinitionCache tasks_;
  DefinitionCache policies_;
  std::deque<DefinitionName> to_check_;
  /// Reports of this turn: one for each learner and definition, however often it asked; a refusal
  /// stands.
  std::map<std::pair<protocol::LearnerId, ContentHash>, protocol::DefinitionReport> reports_;
  std::vector<Evaluator> evaluators_;
  std::int64_t next_job_ = 1;
  TimePoint last_step_;
  TimePoint heartbeat_at_;
  bool status_due_ = false;  ///< what learners should know before the next heartbeat has changed
  bool draining_ = false;
  bool exited_ = false;
  std::optional<TimePoint> drain_end_;
  std::int64_t num_evaluated_ = 0;
  std::int64_t num_failed_ = 0;
  std::int64_t num_repeated_ = 0;
  std::int64_t num_restarts_ = 0;
  std::int64_t num_rejected_ = 0;
  LogLimiter log_limiter_;
};

}  // namespace treeroll::worker
