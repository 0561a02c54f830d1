#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/content_hash.h"
#include "common/base/outcome.h"
#include "common/base/time.h"
#include "common/base/turn.h"
#include "common/protocol/messages.h"

/// What a worker core is told, and what it wants done. Evaluators are numbered 0 .. N-1; a number
/// names one process at a time, from StartEvaluator to EvaluatorDied.
namespace treeroll::worker {

using protocol::DefinitionKind;
using protocol::DefinitionName;

/// What the core needs to know of a definition that an evaluator could build.
struct DefinitionFacts {
  int input_dim = 0;
  int output_dim = 0;
  int theta_dim = 0;       ///< policies; 0: not known, nor is what it takes and gives
  Duration time_limit{};   ///< tasks: CPU time of one roll-out
  bool repeatable = true;  ///< tasks: starting a roll-out once more does no harm
};

enum class Death {
  kExited,         ///< by exit(), whatever the status
  kFatalSignal,    ///< of its own doing: SIGSEGV, SIGFPE, SIGABRT, SIGILL, SIGBUS, SIGXCPU
  kForeignSignal,  ///< any other, such as SIGKILL from us, from a person or for lack of memory
};

// Events of the evaluators.

struct EvaluatorReady {
  int evaluator = 0;
};
/// Answer to LoadDefinition.
struct DefinitionLoaded {
  int evaluator = 0;
  DefinitionName name;
  bool accepted = false;
  std::string text;  ///< accepted task: description as JSON; refused: why
  DefinitionFacts facts;
};
/// Part of the answer to RunRollouts.
struct RolloutEvaluated {
  int evaluator = 0;
  std::int64_t job = 0;  ///< of RunRollouts, and one more for each request before this one
  Outcome outcome;
  std::int64_t duration_ns = 0;
};
/// Answer to AskCpuTime: CPU time since the job was given.
struct CpuTimeMeasured {
  int evaluator = 0;
  std::int64_t job = 0;
  Duration cpu_time{};
};
/// After everything it had still sent.
struct EvaluatorDied {
  int evaluator = 0;
  Death death = Death::kExited;
  int code = 0;  ///< exit status or number of the signal, for the log
};
using EvaluatorEvent = std::variant<EvaluatorReady, DefinitionLoaded, RolloutEvaluated,
                                    CpuTimeMeasured, EvaluatorDied>;

// Events.

/// First event of all, once.
struct Started {};
/// A RolloutBatch, DefinitionPiece or LearnerStatus; others are ignored.
struct MessageReceived {
  protocol::Message message;
};
/// Nothing more to read for now: answers gathered in this turn are sent.
struct InboxDrained {};
struct TimerFired {};
/// SIGTERM, SIGINT or SIGHUP; the second one ends the worker at once.
struct DrainRequested {};

using Event = std::variant<Started, MessageReceived, EvaluatorEvent, InboxDrained, TimerFired,
                           DrainRequested>;

// Effects, to be carried out in their order.

/// In a WorkerStatus the carrier sets receive_buffer_bytes and adds its own to num_rejected.
struct SendMessage {
  protocol::Message message;
};
struct StartEvaluator {
  int evaluator = 0;
};
/// SIGTERM to its program, which may stop motors; KillEvaluator follows where that ends nobody.
struct EndEvaluator {
  int evaluator = 0;
};
/// SIGKILL; EvaluatorDied follows.
struct KillEvaluator {
  int evaluator = 0;
};
/// Only to an idle evaluator, one at a time, so that a send never has to wait for a reader.
struct LoadDefinition {
  int evaluator = 0;
  std::int64_t job = 0;
  DefinitionName name;
  std::string content;
};
struct ForgetDefinition {
  int evaluator = 0;
  DefinitionName name;
};
/// One or more, of one task. Its CPU time counts from here.
struct RunRollouts {
  int evaluator = 0;
  std::int64_t job = 0;
  std::vector<protocol::RolloutRequest> requests;
};
/// CPU time that evaluator has spent on that job.
struct AskCpuTime {
  int evaluator = 0;
  std::int64_t job = 0;
};
/// Last effect of all.
struct Exit {
  int status = 0;
};

using Effect =
    std::variant<SendMessage, StartEvaluator, EndEvaluator, KillEvaluator, LoadDefinition,
                 ForgetDefinition, RunRollouts, AskCpuTime, LogLine, Exit>;
using Effects = std::vector<Effect>;

using Turn = treeroll::Turn<Effect>;

}  // namespace treeroll::worker
