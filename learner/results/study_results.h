#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll {

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
  /// How far the runs have come; empty if every run has ended.
  std::string missing = {};
};

/// Reads runs.csv, rollouts.csv and, where they exist, policies/*.json.
/// Nothing is taken on trust: runs.csv must be what rollouts.csv adds up to, and each
/// switch in it after a roll-out of the layer that was left.
/// Throws std::runtime_error "FILE:LINE: COLUMN = VALUE: RULE", or with the file and the reason.
StudyResults read_study_results(const std::filesystem::path& directory);

}  // namespace treeroll
