#pragma once

#include "learner/core/learner_events.h"

namespace treeroll::learner {

/// Does what the learner wants done: the daemon; in tests one that is virtual.
class EffectHandler {
 public:
  virtual ~EffectHandler() = default;

  virtual void append(const AcceptedResult& result) = 0;  ///< to the journal
  virtual void append(const SecondAnswer& answer) = 0;    ///< to the journal
  virtual void append(const KnownWorker& worker) = 0;     ///< to the journal
  virtual void append(const TaskSignals& signals) = 0;    ///< to the journal
  virtual void append(const LearningTime& time) = 0;      ///< to the journal
  virtual void flush() = 0;  ///< all that was appended has left this process, and outlives it
  virtual void send(const protocol::Message& message) = 0;
  virtual void log(const LogLine& line) = 0;
};

/// Carries effects out in the one order in which this process may end between any two: no message
/// that follows from a result, or from the time, leaves before it. So: what is appended, before
/// messages the flush, the log; within each as they stand. Where nothing is sent what was appended
/// waits for the messages of a later turn, or for the sync. What the handler throws passes through;
/// the rest is not done then.
void carry_out(const Effects& effects, EffectHandler& handler);

}  // namespace treeroll::learner
