#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/content_hash.h"
#include "learner/core/study.h"
#include "learner/fit/start_policy.h"
#include "learner/study/resolved_study.h"
#include "learner/study/study_error.h"

/// A study file (TOML; deploy/studies/README.md says what it may hold) to a Study ready to run.
///
///   const LoadedStudy loaded = load_study("swing_up.toml", {"study.rollouts=50"});
///   for each condition: ask a worker what loaded.study.conditions[i].task_content is, and
///   check_task(loaded, i, {.input_dim = 1, .output_dim = 1});
namespace treeroll {

struct LoadedStudy {
  Study study;
  /// What was read, of the file itself and with plain line ends: a journal knows a study by the
  /// hash of this. Read once, as a learner may be writing the file anew.
  std::string text;
  ResolvedStudy resolved;
  /// By condition: StartPolicy::log_likelihoods.
  std::vector<std::vector<double>> log_likelihoods;
  /// By condition: StartPolicy::demonstration.
  std::vector<std::shared_ptr<const Eigen::MatrixXd>> demonstrations;
  /// By condition: what the task calls inputs and outputs, else a demonstration from files; empty
  /// without either.
  std::vector<std::vector<std::string>> columns;
  std::vector<SettingOrigins> origins;  ///< by condition: where its settings stand
  /// Of all settings but those that may grow once a study has begun (study_extension.h).
  ContentHash lasting_id;
};

/// Throws StudyError on anything that cannot be run, before anything is started: see StudyDocument
/// for the file itself; unknown keys, wrong types and values out of bounds; more than 100 000 runs
/// or 10^8 roll-outs, 10^6 of them in flight; a policy or a task too large for one message.
/// @param policies  the kinds of policies a study may name
LoadedStudy load_study(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       const PolicyRegistry& policies = learnable_policies(),
                       StoredStarts starts = StoredStarts::kTaken);

/// The same of the study.toml of a state directory: one that does not say its form is of the first.
LoadedStudy load_resolved_study(const std::filesystem::path& file,
                                const std::vector<std::string>& overrides = {},
                                StoredStarts starts = StoredStarts::kTaken);

/// The error of a condition's setting, with where it stands, also for those whom a worker tells
/// ("task.step_s").
StudyError condition_error(const LoadedStudy& loaded, std::size_t condition,
                           const ConfigError& error);

/// What a worker's description says of the policies a task executes.
struct TaskDims {
  int input_dim = 0;
  int output_dim = 0;
  SignalNames signals = {};  ///< what it calls them
};

/// Throws StudyError if the condition's policy has other dimensions, or its study or the file of
/// its start policy other names for them.
void check_task(const LoadedStudy& loaded, std::size_t condition, TaskDims task);

}  // namespace treeroll
