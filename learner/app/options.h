#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "learner/web/page_options.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// The command line of treeroll-learner.
struct LearnerOptions {
  std::filesystem::path study_file;    ///< of a new study
  std::filesystem::path resume_dir;    ///< or the state directory of one that is to go on
  bool salvage = false;                ///< of a damaged journal keep the part before the damage
  std::vector<std::string> overrides;  ///< KEY=VALUE, each
  std::filesystem::path state_dir;     ///< empty: treeroll-runs/NAME
  int local_workers = 0;               ///< evaluators of a worker daemon of our own; 0: none
  WorkerProgram worker_program;
  bool needs_worker_program = false;  ///< else remote workers may describe and evaluate the tasks
  std::string lcm_url;                ///< resolved
  std::filesystem::path key_file;     ///< empty: nothing is signed
  web::PageOptions page;              ///< --http
  std::optional<std::string> help_keys;  ///< list the keys of a study that hold this, and end
  bool check = false;                    ///< say what the study would do
  int preview = 0;                 ///< above 0: show so many perturbed policies, start nothing
  std::filesystem::path new_file;  ///< a study to be written, of `new_task`
  std::string new_task;
  bool json = false;  ///< print the summary as JSON on standard output
};

/// Where the results of a study of that name go.
inline std::filesystem::path results_directory(const LearnerOptions& options,
                                               const std::string& study_name) {
  return options.state_dir.empty() ? std::filesystem::path("treeroll-runs") / study_name
                                   : options.state_dir;
}

}  // namespace treeroll
