#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/base/outcome.h"
#include "common/task_facts/task_description.h"
#include "learner/worker_program/rollout_trace.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// A policy to be evaluated by a worker executable in a process of its own, off the bus.
struct EvaluationRequest {
  std::string task_content;  ///< Condition::task_content
  std::string policy_text;   ///< JSON of common/policy/policy.h
  std::int64_t seed = 0;     ///< for tasks that are not deterministic
  bool trace = false;
  /// A person wants this very roll-out. Needed for a task that says repeatable = false: it may be a
  /// robot, and moves.
  bool is_asked_for = false;
};

struct PolicyEvaluation {
  Outcome outcome;
  /// What the reward is made of, by name, if the task says so.
  std::map<std::string, double> terms = {};
  /// That the task took, on the clock; nothing if the executable does not say, or was ended.
  std::optional<double> duration_s = {};
  RolloutTrace trace = {};  ///< empty if it was not asked for, or the task records none
};

/// Asks a worker executable (`--evaluate`). A crash and a hang are answers: statuses with reward 0.
/// The answer is a user's program's and is checked like anything from outside.
/// @param task  what the executable has said of the task
/// Throws ConfigError for what it refuses, std::runtime_error if it cannot be asked or says nothing
/// that can be read.
PolicyEvaluation evaluate_with(const WorkerProgram& worker_program, const TaskDescription& task,
                               const EvaluationRequest& request);

}  // namespace treeroll
