#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "common/base/time.h"
#include "common/protocol/limits.h"
#include "common/protocol/messages.h"

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
  int num_strikes_max = 3;  ///< evaluators a roll-out or a definition may end before it is answered
  int num_accidents_max = 3;  ///< evaluators others may end under a roll-out before it is given up

  Duration learner_silence_max = std::chrono::seconds(60);
  Duration busy_heartbeat = std::chrono::milliseconds(100);
  Duration idle_heartbeat = std::chrono::milliseconds(250);
  Duration repeat_interval_min = std::chrono::milliseconds(3);
  Duration repeat_interval_max = std::chrono::seconds(1);
  Duration ask_interval = std::chrono::milliseconds(50);
  Duration definition_wait_max = std::chrono::seconds(30);
  Duration start_time_max = std::chrono::seconds(30);   ///< from start to ready
  Duration load_time_limit = std::chrono::seconds(10);  ///< CPU time to build a task or policy
  Duration restart_delay_min = std::chrono::milliseconds(10);
  Duration restart_delay_max = std::chrono::seconds(5);
  Duration drain_grace = std::chrono::seconds(5);
};

}  // namespace treeroll::worker
