#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/content_hash.h"
#include "learner/core/run_record.h"

namespace treeroll {

/// The directory of a study: study.toml and journal.lcmlog, from which everything can be made
/// again, and the results: rollouts.csv, runs.csv and policies/, two JSON files of each run.

std::filesystem::path study_of(const std::filesystem::path& directory);
std::filesystem::path journal_of(const std::filesystem::path& directory);

/// What a journal calls the study of its directory: content_hash() of study.toml, whose lines count
/// as ending with "\n". Throws std::runtime_error if it cannot be read.
ContentHash study_id_of(const std::filesystem::path& directory);

/// How the file of a final mean policy ends, where that of the best roll-out has ".json".
inline constexpr std::string_view kFinalPolicyEnding = ".final.json";
/// "policies/tree-3.json": the policy of the run's best roll-out.
std::string best_policy_file(const RunRecord& run);
/// "policies/tree-3.final.json": its final mean policy.
std::string final_policy_file(const RunRecord& run);

/// Throws ConfigError of this option unless the path is free or an empty directory.
void require_new_directory(const char* option, const std::filesystem::path& directory);
/// Throws ConfigError unless the path is free or a directory in which nothing has been learnt.
void check_state_directory(const std::filesystem::path& directory);
/// Throws ConfigError unless a learner has begun a study there.
void check_resumable(const std::filesystem::path& directory);
/// Writes the results, the small ones first; goes on after a failure, and then throws
/// std::runtime_error: what could not be written and why.
void write_results(const std::filesystem::path& directory, const std::vector<RunRecord>& runs);

}  // namespace treeroll
