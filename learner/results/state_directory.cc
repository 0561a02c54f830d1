#include "learner/results/state_directory.h"

#include <fmt/format.h>

#include "common/base/config_error.h"
#include "common/base/line_ends.h"
#include "common/files/atomic_file.h"
#include "common/files/whole_file.h"
#include "learner/results/csv.h"

namespace treeroll {

namespace fs = std::filesystem;

fs::path study_of(const fs::path& directory) { return directory / "study.toml"; }
fs::path journal_of(const fs::path& directory) { return directory / "journal.lcmlog"; }

ContentHash study_id_of(const fs::path& directory) {
  return content_hash(with_plain_line_ends(read_whole_file(study_of(directory))));
}

std::string best_policy_file(const RunRecord& run) {
  return fmt::format("policies/{}-{}.json", run.condition, run.repetition);
}

std::string final_policy_file(const RunRecord& run) {
  return fmt::format("policies/{}-{}{}", run.condition, run.repetition, kFinalPolicyEnding);
}

void check_state_directory(const fs::path& directory) {
  const auto refuse = [&directory](const std::string& rule) {
    throw ConfigError("--state-dir", directory.string(), rule);
  };
  std::error_code error;
  const fs::file_status status = fs::status(directory, error);
  if (status.type() == fs::file_type::not_found) return;
  if (error) refuse(error.message());
  if (!fs::is_directory(status)) refuse("must be a directory");
  for (const fs::path& entry : fs::directory_iterator(directory, error)) {
    // What a learner leaves that is ended while it begins: it locks an empty journal, then writes
    // the study.
    std::error_code not_a_file;
    if (entry == journal_of(directory) && fs::file_size(entry, not_a_file) == 0) continue;
    if (entry == unfinished(study_of(directory))) continue;
    refuse(
        "must be new or empty; it may hold what an earlier study has yielded. --resume goes on "
        "with that, "
        "--state-dir names another");
  }
  if (error) refuse(error.message());
}

void require_new_directory(const char* option, const fs::path& directory) {
  std::error_code error;
  const fs::file_status status = fs::status(directory, error);
  if (status.type() == fs::file_type::not_found) return;
  if (status.type() == fs::file_type::directory && fs::is_empty(directory, error)) return;
  throw ConfigError(option, directory.string(), "must be a new or empty directory");
}

void check_resumable(const fs::path& directory) {
  for (const fs::path& file : {study_of(directory), journal_of(directory)}) {
    std::error_code error;
    if (fs::is_regular_file(file, error)) continue;
    throw ConfigError("--resume", directory.string(),
                      fmt::format("must be the state directory of a study; it has no {}",
                                  file.filename().string()));
  }
}

void write_results(const fs::path& directory, const std::vector<RunRecord>& runs) {
  std::string failures;
  const auto attempt = [&failures](const auto& write) {
    try {
      write();
    } catch (const std::exception& error) {
      failures += (failures.empty() ? "" : "; ") + std::string(error.what());
    }
  };
  attempt([&] { write_runs_csv(directory / "runs.csv", runs); });
  attempt([&] {
    std::vector<NamedText> policies;
    for (const RunRecord& run : runs) {
      if (!run.best_policy.empty()) {
        policies.push_back({fs::path(best_policy_file(run)).filename(), run.best_policy});
      }
      // Of a run that has not ended the mean policy is no final one; nor is that of the smaller
      // study that an extension goes on with.
      if (run.final_reward && !run.final_policy.empty()) {
        policies.push_back({fs::path(final_policy_file(run)).filename(), run.final_policy});
      } else {
        fs::remove(directory / final_policy_file(run));
      }
    }
    make_directories_durably(directory / "policies");
    write_atomically(directory / "policies", policies);
  });
  attempt([&] { write_rollouts_csv(directory / "rollouts.csv", runs); });
  if (!failures.empty()) throw std::runtime_error(failures);
}

}  // namespace treeroll
