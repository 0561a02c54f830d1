#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace treeroll {

inline constexpr const char* kWorkerProgramOption = "--worker-program";
inline constexpr const char* kEvaluatorOption = "--evaluator";

/// A worker executable, and the user's own program that evaluates in place of its tasks, if there
/// is one.
struct WorkerProgram {
  /// What it is started with.
  std::vector<std::string> arguments(std::vector<std::string> first) const {
    if (!evaluator.empty()) first.insert(first.end(), {kEvaluatorOption, evaluator});
    return first;
  }

  std::filesystem::path path;
  std::string evaluator;  ///< the command of the user's program; empty: none
};

/// Throws ConfigError if the worker executable cannot be executed.
void check_executable(const WorkerProgram& program);

/// What the options of that name give, before anything is asked of it or begun with it: a command
/// that cannot be started is no task's fault. Without the first it is treeroll-worker beside this
/// program, which may not be there. Throws ConfigError for what cannot be executed.
void check_and_complete(WorkerProgram& given);

/// Wall time in which a worker executable starts and describes a task. A user's program may take
/// long to start: an interpreter, a simulator, its models.
inline constexpr std::chrono::seconds kDescriptionLimit{90};

/// Of the option that gives it, the same in every program.
inline constexpr const char* kEvaluatorHelp =
    "Command of a program of your own, in any language, that evaluates the task: "
    "\"python3 my_task.py\"";

}  // namespace treeroll
