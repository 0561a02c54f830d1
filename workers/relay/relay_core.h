#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/base/log_limiter.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "learner/core/worker_table.h"
#include "workers/core/worker_core.h"
#include "workers/relay/rack.h"
#include "workers/relay/relay_events.h"

namespace treeroll::relay {

struct RelaySettings {
  protocol::WorkerId relay_id = 0;  ///< random, drawn at start; its worker's id above
  std::string host;
  std::int32_t pid = 0;
  std::string version;
  std::string numeric_class;  ///< that is served; empty: that of the first worker heard
  std::size_t batch_bytes_above = protocol::kBatchBytesLocalMax;
  std::size_t batch_bytes_below = protocol::kBatchBytesLocalMax;
  std::size_t word_bytes_below = 0;  ///< of a batch, for each worker that it names
};

/// A relay as a pure state machine: one worker to the learners above, one learner for each of them
/// to the workers below. The worker's core and the learner's workforce, composed: a Rack of workers
/// takes the place of evaluator processes. No clock, no network; the daemon carries out the
/// effects.
///
///   RelayCore core(settings);
///   core.step(now, Started{}, effects);
///   ... for each event, and TimerFired at core.next_deadline():
///   core.step(now, event, effects);  // carry out and clear the effects, in order
///   ... once both inboxes are drained:
///   core.step(now, InboxDrained{}, effects);
class RelayCore {
 public:
  explicit RelayCore(RelaySettings settings);
  RelayCore(const RelayCore&) = delete;  // its parts refer to each other
  RelayCore& operator=(const RelayCore&) = delete;

  /// Appends to `effects`. Time must not go backwards.
  void step(TimePoint now, const Event& event, Effects& effects);
  /// When TimerFired is due unless an event comes before. TimePoint::max() after Exit.
  TimePoint next_deadline() const;

 private:
  void on(const Turn& turn, const Started& event);
  void on(const Turn& turn, const MessageFromAbove& event);
  void on(const Turn& turn, const MessageFromBelow& event);
  void on(const Turn& turn, const InboxDrained& event);
  void on(const Turn& turn, const TimerFired& event);
  void on(const Turn& turn, const DrainRequested& event);

  bool take_status(const Turn& turn, const protocol::WorkerStatus& status);
  bool is_served(protocol::WorkerId worker) const;
  void choose_class(const Turn& turn, const std::string& numeric_class);
  Standing::Use use_of(learner::WorkerEntry& worker, TimePoint now) const;
  void count_evaluators(const Turn& turn);
  void step_upwards(const Turn& turn, const worker::Event& event);
  void settle(const Turn& turn);

  RelaySettings settings_;
  Rack rack_;
  learner::WorkerTable workers_;             ///< all that are heard below
  std::optional<worker::WorkerCore> above_;  ///< once a class is known
  bool counts_again_ = false;                ///< evaluators, before what it does next
  TimePoint remind_at_;
  bool exited_ = false;
  LogLimiter log_limiter_;
};

}  // namespace treeroll::relay
