#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "common/base/time.h"
#include "common/protocol/limits.h"
#include "common/protocol/messages.h"
#include "common/protocol/timings.h"

namespace treeroll::worker {

/// What a worker is, and every bound and interval of its core.
struct WorkerSettings {
  protocol::WorkerId worker_id = 0;  ///< random, drawn at start
  std::string host;
  std::int32_t pid = 0;
  std::string version;
  std::string numeric_class;
  int num_evaluators = 1;
  std::size_t batch_bytes_max = protocol::kBatchBytesLocalMax;

  // Bounds: common/protocol/limits.h.
  int held_per_evaluator_max = protocol::kHeldPerEvaluatorMax;
  std::size_t num_learners_max = protocol::kLearnersPerWorkerMax;
  std::size_t num_answers_max = protocol::kAnswersMax;
  std::size_t num_tasks_max = protocol::kTasksMax;
  std::size_t num_policies_max = protocol::kPoliciesMax;
  std::size_t definition_bytes_max = protocol::kDefinitionCacheBytesMax;
  std::size_t num_partial_max = protocol::kPartialDefinitionsMax;
  std::size_t partial_bytes_max = protocol::kPartialBytesMax;
  std::size_t together_max = 32;  ///< roll-outs that an evaluator is given at once
  /// Numbers of their thetas, where they are several: its socket has room for so many.
  std::size_t together_numbers_max = 4096;
  /// So many roll-outs an evaluator are few: their answers are sent at once.
  double few_per_evaluator = 2;
  int num_strikes_max = 3;  ///< evaluators a roll-out or a definition may end before it is answered
  int num_accidents_max = 3;  ///< evaluators others may end under a roll-out before it is given up

  // What learners rely on: common/protocol/timings.h.
  Duration learner_gone = protocol::kLearnerGone;
  Duration learner_silence_max = protocol::kLearnerSilenceMax;
  Duration answer_delay_max = protocol::kAnswerDelayMax;
  Duration repeat_interval_min = protocol::kRepeatIntervalMin;
  Duration repeat_interval_max = protocol::kRepeatIntervalMax;
  Duration repeat_interval_lossy = protocol::kRepeatIntervalLossy;
  Duration settle_interval_min = protocol::kSettleIntervalMin;
  Duration ask_interval_min = protocol::kAskIntervalMin;
  Duration ask_interval_max = protocol::kAskIntervalMax;
  Duration definition_wait_max = protocol::kDefinitionWaitMax;
  Duration drain_grace = protocol::kDrainGrace;

  /// One that has held nothing for so long drains by itself; nothing: it never does.
  std::optional<Duration> idle_max;
  /// To be finished by a worker that is asked to end; a service manager waits 90 s by default.
  Duration drain_rollouts_max = std::chrono::seconds(60);
  /// What roll-outs given at once take together: the first answer waits for the last.
  Duration together_time_max = protocol::kAnswerDelayMax;
  Duration start_time_max = std::chrono::seconds(30);   ///< from start to ready
  Duration load_time_limit = std::chrono::seconds(10);  ///< CPU time to build a task or policy
  /// From EndEvaluator to KillEvaluator. 0: an evaluator runs no program that could use it.
  Duration end_grace{};
  /// An evaluator forgets its task before it loads another: a user's program has one at a time.
  bool one_task_at_a_time = false;
  Duration restart_delay_min = std::chrono::milliseconds(10);
  Duration restart_delay_max = std::chrono::seconds(5);
};

}  // namespace treeroll::worker
