#pragma once

#include <string_view>

#include "common/base/result.h"

namespace treeroll {

/// What a worker has said of a task; the learner itself knows no task.
struct TaskFacts {
  int input_dim = 0;
  int output_dim = 0;
  double reward_min = 0;
  double reward_max = 1;
  double time_limit_s = 0;
  bool deterministic = true;

  /// False for what is no number, too.
  bool is_in_range(double reward) const { return reward >= reward_min && reward <= reward_max; }
  bool operator==(const TaskFacts&) const = default;
};

/// Reads a worker's description (JSON from outside): all fields present, of their type, finite,
/// dimensions positive, 0 <= reward_min <= reward_max.
Result<TaskFacts> task_facts_from_json(std::string_view text);

}  // namespace treeroll
