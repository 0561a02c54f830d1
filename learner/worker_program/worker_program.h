#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace treeroll {

/// A worker executable, and the user's own program that evaluates in place of its tasks, if there
/// is one.
struct WorkerProgram {
  WorkerProgram() = default;
  // One may stand for the other: most have no program of the user's.
  WorkerProgram(std::filesystem::path executable)  // NOLINT(google-explicit-constructor)
      : path(std::move(executable)) {}

  /// What it is started with.
  std::vector<std::string> arguments(std::vector<std::string> first) const {
    if (!evaluator.empty()) first.insert(first.end(), {"--evaluator", evaluator});
    return first;
  }

  std::filesystem::path path;
  std::string evaluator;  ///< the command of the user's program; empty: none
};

/// Of the option that gives it, the same in every program.
inline constexpr const char* kEvaluatorHelp =
    "Command of a program of your own, in any language, that evaluates the task: "
    "\"python3 my_task.py\"";

}  // namespace treeroll
