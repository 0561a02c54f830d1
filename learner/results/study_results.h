#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll {

/// How long the runs of a condition may be, and what ends one of them before: it is done.
struct RunEnding {
  int budget = 0;  ///< roll-outs; 0: not known
  std::optional<double> stop_at_reward = {};
  /// By their convergence, and by nothing else: a study's time that is up, say, cannot be told from
  /// it in the results.
  bool is_on_convergence = false;
};

/// What a study has left in its state directory.
struct StudyResults {
  std::string name;                 ///< study.name; whoever can read study.toml fills it in
  std::filesystem::path directory;  ///< where it was read from
  std::vector<RunRecord> runs;      ///< by number: condition in the study's order, then repetition
  /// By condition that starts from a fit: log-likelihood per sample of the demonstration under the
  /// finest layer. Nothing in the tables tells it; whoever can fit fills it in.
  std::map<std::string, double> log_likelihoods = {};
  /// What study.toml knows of the tasks; whoever can read it fills it in, too.
  std::map<std::string, bool> determinism = {};
  /// By condition, what study.toml says of it; filled in likewise.
  std::map<std::string, RunEnding> endings = {};
  /// How far the runs have come; empty if every run has ended.
  std::string missing = {};
};

/// Reads runs.csv, rollouts.csv and, where they exist, policies/*.json.
/// Nothing is taken on trust: runs.csv must be what rollouts.csv adds up to, and each
/// switch in it after a roll-out of the layer that was left.
/// Throws std::runtime_error "FILE:LINE: COLUMN = VALUE: RULE", or with the file and the reason.
StudyResults read_study_results(const std::filesystem::path& directory);

}  // namespace treeroll
