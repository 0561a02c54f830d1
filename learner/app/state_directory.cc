#include "learner/app/state_directory.h"

#include <fmt/format.h>

#include "common/base/config_error.h"
#include "learner/report/atomic_file.h"
#include "learner/report/csv.h"

namespace treeroll {

namespace fs = std::filesystem;

void check_state_directory(const fs::path& directory) {
  const auto refuse = [&directory](const std::string& rule) {
    throw ConfigError("--state-dir", directory.string(), rule);
  };
  std::error_code error;
  const fs::file_status status = fs::status(directory, error);
  if (status.type() == fs::file_type::not_found) return;
  if (error) refuse(error.message());
  if (!fs::is_directory(status)) refuse("must be a directory");
  const bool empty = fs::is_empty(directory, error);
  if (error) refuse(error.message());
  if (!empty) refuse("must be new or empty; it may hold what an earlier study has yielded");
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
