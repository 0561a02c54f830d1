#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace treeroll {

/// A worker executable, and the user's own program that evaluates in place of its tasks, if there
/// is one.
struct WorkerProgram {
  /// What it is started with.
  std::vector<std::string> arguments(std::vector<std::string> first) const {
    if (!evaluator.empty()) first.insert(first.end(), {"--evaluator", evaluator});
    return first;
  }

  std::filesystem::path path;
  std::string evaluator;  ///< the command of the user's program; empty: none
};

/// Wall time in which a worker executable starts and describes a task. A user's program may take
/// long to start: an interpreter, a simulator, its models.
inline constexpr std::chrono::seconds kDescriptionLimit{90};

/// Of the option that gives it, the same in every program.
inline constexpr const char* kEvaluatorHelp =
    "Command of a program of your own, in any language, that evaluates the task: "
    "\"python3 my_task.py\"";

}  // namespace treeroll
