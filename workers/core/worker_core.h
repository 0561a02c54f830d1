#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/base/log_limiter.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "workers/core/answer_store.h"
#include "workers/core/definition_shelf.h"
#include "workers/core/evaluators.h"
#include "workers/core/learner_link.h"
#include "workers/core/rollout_queue.h"
#include "workers/core/worker_events.h"
#include "workers/core/worker_settings.h"

namespace treeroll::worker {

/// A worker as a pure state machine: which learners it serves, which roll-outs it holds for them,
/// what it answers, repeats and asks for. Its Evaluators evaluate them. No clock, no
/// process, no network; the daemon carries out the effects.
///
///   WorkerCore core(settings);
///   core.step(now, Started{}, effects);
///   ... for each event, and TimerFired at core.next_deadline():
///   core.step(now, event, effects);  // carry out and clear the effects, in order
///   ... once the inbox is drained:
///   core.step(now, InboxDrained{}, effects);
class WorkerCore {
 public:
  /// With processes of this host.
  explicit WorkerCore(WorkerSettings settings);
  /// With others, which must outlive it; as many as they say, whatever the settings do.
  WorkerCore(WorkerSettings settings, Evaluators& evaluators);
  /// Its parts read its settings.
  WorkerCore(const WorkerCore&) = delete;
  WorkerCore& operator=(const WorkerCore&) = delete;

  /// Appends to `effects`. Time must not go backwards.
  void step(TimePoint now, Event event, Effects& effects);

  /// When TimerFired is due unless an event comes before. TimePoint::max() after Exit.
  TimePoint next_deadline() const;

 private:
  void on(const Turn& turn, const Started& event);
  void on(const Turn& turn, MessageReceived& event);  // what it holds is taken
  void on(const Turn& turn, const EvaluatorEvent& event);
  void on(const Turn& turn, const InboxDrained& event);
  void on(const Turn& turn, const TimerFired& event);
  void on(const Turn& turn, const DrainRequested& event);

  // worker_core.cc: learners, and when it leaves.
  LearnerLink* meet(const Turn& turn, protocol::LearnerId id);
  void forget(const Turn& turn, protocol::LearnerId id);
  bool is_from_the_past(const protocol::RolloutBatch& batch) const;
  void receive(const Turn& turn, protocol::RolloutBatch& batch);
  void drain(const Turn& turn, const std::string& why);
  void leave_if_drained(const Turn& turn);
  void exit(const Turn& turn, int status);

  // worker_core_rollouts.cc: the roll-outs held for them, from the request to its end.
  void take_request(const Turn& turn, protocol::LearnerId learner, std::int64_t sequence,
                    protocol::RolloutRequest request);
  void drop(const RolloutName& name);
  void review(const RolloutName& name);
  void assign_work(const Turn& turn);
  void conclude(const Turn& turn, const WorkEnd& end);
  void give_up_in_trouble(const Turn& turn);
  void give_up_work_of(const Turn& turn, protocol::LearnerId id);

  // worker_core_definitions.cc: what is lacking, and what is to be checked.
  void ask_for_definitions(const Turn& turn, protocol::LearnerId id, LearnerLink& learner);
  void take_theta(const Turn& turn, const protocol::DefinitionPiece& piece);
  bool checks_another() const;
  void note_check(TimePoint now);
  std::optional<DefinitionName> next_check(TimePoint now);

  // worker_core_sending.cc: what goes out.
  std::int64_t send_batch(const Turn& turn, protocol::LearnerId id, LearnerLink& learner,
                          std::int64_t first);
  Duration answer_wait(protocol::LearnerId id, const LearnerLink& learner) const;
  void send_answers_if_due(const Turn& turn, protocol::LearnerId id, LearnerLink& learner);
  void send_new_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner);
  void repeat_answers(const Turn& turn, protocol::LearnerId id, LearnerLink& learner);
  void send_status(const Turn& turn);
  Duration heartbeat() const;
  void beat_within(const Turn& turn, Duration interval);
  bool takes_wake(TimePoint now);
  void count_workers(TimePoint now);
  int free_slots() const;
  std::size_t batch_room() const;

  const WorkerSettings settings_;
  std::map<protocol::LearnerId, LearnerLink> learners_;
  /// The last batch of those that are forgotten: what comes after them is new.
  std::map<protocol::LearnerId, std::int64_t> last_batches_;
  RolloutQueue queue_;
  AnswerStore answers_;
  DefinitionShelf definitions_;
  std::unique_ptr<Evaluators> pool_;  ///< of this host; null where others evaluate
  Evaluators& evaluators_;
  std::optional<DefinitionName> other_check_;  ///< the last one that no roll-out waited for
  TimePoint other_check_began_;
  std::optional<TimePoint> other_check_ended_;
  TimePoint last_step_;
  TimePoint heartbeat_at_;
  TimePoint wake_at_;        ///< not before: a learner that is not served makes one come sooner
  int num_workers_ = 0;      ///< those of its learners that hear the fewest hear so many
  bool status_due_ = false;  ///< what learners should know before the next heartbeat has changed
  TimePoint busy_at_;        ///< held something last, or started
  bool draining_ = false;
  bool exited_ = false;
  std::optional<TimePoint> finish_by_;  ///< draining: no later than this for what runs
  std::optional<TimePoint> drain_end_;  ///< and for the last acknowledgements
  std::int64_t num_evaluated_ = 0;
  std::int64_t num_failed_ = 0;
  std::int64_t num_repeated_ = 0;
  std::int64_t num_rejected_ = 0;
  LogLimiter log_limiter_;
};

}  // namespace treeroll::worker
