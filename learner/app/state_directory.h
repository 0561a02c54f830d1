#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll {

/// The directory a study's results go to: study.toml, rollouts.csv, runs.csv and policies/, a JSON
/// file with the best policy of each run.

/// Throws ConfigError unless the path is free or an empty directory.
void check_state_directory(const std::filesystem::path& directory);
/// Makes it and writes the resolved study. Throws std::runtime_error naming the path.
void make_state_directory(const std::filesystem::path& directory, const std::string& resolved_toml);
void write_results(const std::filesystem::path& directory, const std::vector<RunRecord>& runs);

}  // namespace treeroll
