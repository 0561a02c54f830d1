#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "workers/tasks/task.h"

namespace treeroll::worker {

class UserProgram;

/// One roll-out to be evaluated.
struct Trial {
  PolicyPtr policy;  ///< with the roll-out's theta
  std::uint64_t seed = 0;
  std::int64_t run = 0;      ///< for the log
  std::int64_t rollout = 0;  ///< for the log
};

/// A task as an evaluator has it, whoever evaluates it: a task of this executable or the user's own
/// program. What a task throws, a reward that is not finite or outside the range it describes, is
/// status kFailed with a reason. Want of memory is thrown: it is the host's, not the roll-out's.
class EvaluatedTask {
 public:
  virtual ~EvaluatedTask() = default;
  virtual const TaskDescription& description() const = 0;
  /// @param trace  receives the roll-out step by step, or its terms alone; may be null
  virtual Outcome evaluate(const Trial& trial, Trace* trace) = 0;
  /// Whether evaluate_all() is more than one after the other.
  virtual bool side_by_side() const { return false; }
  /// Each to the bit as evaluate() gives it. Nothing if they are to be evaluated one by one.
  virtual std::optional<std::vector<Outcome>> evaluate_all(std::span<const Trial> /*trials*/) {
    return std::nullopt;
  }
};

/// Where an evaluator's tasks come from.
class TaskSource {
 public:
  virtual ~TaskSource() = default;
  /// Makes a task from the content of a task definition, as make_task() does.
  virtual std::unique_ptr<EvaluatedTask> make(const std::string& content,
                                              nlohmann::json& resolved) = 0;
  /// From here on an evaluation of these tasks ends itself (SIGXCPU) after so much processor time.
  virtual void limit_cpu_time(double limit_s) = 0;
  /// Waits until `descriptor` can be read.
  virtual void attend(int /*descriptor*/) {}
};

/// Tasks of this executable. The registry must outlive the source.
std::unique_ptr<TaskSource> tasks_of(const TaskRegistry& registry);
/// Tasks that the user's program takes, whatever their names.
std::unique_ptr<TaskSource> tasks_of(std::unique_ptr<UserProgram> program);
/// One of the two, to be begun with where what is wrong can be answered. Throws ConfigError.
using TaskSourceMaker = std::function<std::unique_ptr<TaskSource>()>;

}  // namespace treeroll::worker
