#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// The command line of treeroll-evaluate.
struct EvaluateOptions {
  std::filesystem::path policy_file;
  std::filesystem::path study_file;
  std::string condition;               ///< empty: the study's conditions must share one task
  std::vector<std::string> overrides;  ///< KEY=VALUE, each
  WorkerProgram worker_program;
  std::int64_t seed = 0;             ///< for tasks that are not deterministic
  int evaluations = 1;               ///< with this seed and those that follow
  std::filesystem::path trace_file;  ///< empty: no trace
  bool json = false;
};

/// What a policy is worth on a study's task: its reward, or the mean of several evaluations with
/// its interval. The learner knows no task: it asks a worker executable
/// (`--describe-task`, then `--evaluate`), off the bus. Prints reward and status, as lines or as
/// JSON, and writes the trace as CSV (numbers in their shortest exact form; a number that is not
/// finite is an empty field). A policy whose evaluation fails has reward 0 and says why by its
/// status: that is an answer too.
/// Throws StudyError and ConfigError for bad input, std::runtime_error for anything else.
void evaluate_policy(const EvaluateOptions& options);

}  // namespace treeroll
