#include "learner/app/state_directory.h"

#include <fmt/format.h>

#include "learner/app/study_file.h"
#include "learner/report/atomic_file.h"
#include "learner/report/csv.h"

namespace treeroll {

namespace fs = std::filesystem;

void check_state_directory(const fs::path& directory) {
  std::error_code error;
  const fs::file_status status = fs::status(directory, error);
  if (status.type() == fs::file_type::not_found) return;
  if (error) {
    throw StudyError(fmt::format("--state-dir = {}: {}", directory.string(), error.message()));
  }
  if (!fs::is_directory(status)) {
    throw StudyError(fmt::format("--state-dir = {}: must be a directory", directory.string()));
  }
  const bool empty = fs::is_empty(directory, error);
  if (error) {
    throw StudyError(fmt::format("--state-dir = {}: {}", directory.string(), error.message()));
  }
  if (!empty) {
    throw StudyError(
        fmt::format("--state-dir = {}: must be new or empty, and holds the results "
                    "of an earlier study; name another",
                    directory.string()));
  }
}

void make_state_directory(const fs::path& directory, const std::string& resolved_toml) {
  fs::create_directories(directory / "policies");
  write_atomically(directory / "study.toml", resolved_toml);
}

void write_results(const fs::path& directory, const std::vector<RunRecord>& runs) {
  write_rollouts_csv(directory / "rollouts.csv", runs);
  write_runs_csv(directory / "runs.csv", runs);
  for (const RunRecord& run : runs) {
    if (run.best_policy.empty()) continue;
    const std::string name = fmt::format("{}-{}.json", run.condition, run.repetition);
    write_atomically(directory / "policies" / name, run.best_policy);
  }
}

}  // namespace treeroll
