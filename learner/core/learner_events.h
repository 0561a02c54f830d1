#pragma once

#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "common/base/turn.h"
#include "common/protocol/messages.h"
#include "learner/core/accepted_result.h"
#include "learner/core/known_worker.h"
#include "learner/core/learning_time.h"
#include "learner/core/task_signals.h"

/// What a learner core is told, and what it wants done.
namespace treeroll::learner {

// Events.

/// First event of all, once.
struct Started {};
/// A result that an earlier incarnation accepted, in its order.
struct ResultRecovered {
  AcceptedResult result;
  /// The number its run had then. More repetitions number runs anew, and an answer names its
  /// question with the number of that time. Nothing: as now.
  std::optional<std::int32_t> run_then = std::nullopt;
  /// An evaluation of a study that has been extended since: it counts only if it is asked for now.
  bool may_be_superseded = false;
};
/// One more answer to the question of such a result, that an earlier incarnation has compared.
struct SecondRecovered {
  SecondAnswer answer;
  std::optional<std::int32_t> run_then = std::nullopt;  ///< as ResultRecovered has it
  bool may_be_superseded = false;
};
/// A worker whose results follow, as an earlier incarnation noted it.
struct WorkerRecovered {
  KnownWorker worker;
};
/// The same of names of signals.
struct SignalsRecovered {
  TaskSignals signals;
};
/// The same of the time it had counted.
struct TimeRecovered {
  LearningTime time;
};
/// What earlier incarnations have left has been told: from now on time counts. After Started and
/// all that is recovered, before all others, once.
struct RecoveryFinished {};
/// Those of workers; others are ignored.
struct MessageReceived {
  protocol::Message message;
};
/// Nothing more to read for now: time to answer.
struct InboxDrained {};
struct TimerFired {};
/// What has been accepted so far is on its way to stable storage; JournalSynced follows.
struct SyncBegun {};
/// What had been accepted before the last SyncBegun is on stable storage.
struct JournalSynced {};
/// No more roll-outs; the outcome follows once those under way are in. Asked again: at once.
struct StopRequested {};

using Event = std::variant<Started, ResultRecovered, SecondRecovered, WorkerRecovered,
                           SignalsRecovered, TimeRecovered, RecoveryFinished, MessageReceived,
                           InboxDrained, TimerFired, SyncBegun, JournalSynced, StopRequested>;

// Effects, to be carried out by carry_out(), which knows their order.

struct AppendResult {
  AcceptedResult result;
};
struct AppendSecond {
  SecondAnswer answer;
};
/// Before the first result of this worker.
struct AppendWorker {
  KnownWorker worker;
};
/// Before the first result of this task that follows from it.
struct AppendSignals {
  TaskSignals signals;
};
struct AppendTime {
  LearningTime time;
};
struct SendMessage {
  protocol::Message message;
};

using Effect = std::variant<AppendResult, AppendSecond, AppendWorker, AppendSignals, AppendTime,
                            SendMessage, LogLine>;
using Effects = std::vector<Effect>;

using Turn = treeroll::Turn<Effect>;

}  // namespace treeroll::learner
