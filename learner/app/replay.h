#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/web/page_options.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// The command line of treeroll-replay.
struct ReplayOptions {
  std::filesystem::path path;  ///< a state directory, or a journal beside its study.toml
  bool verify = false;
  bool refit = false;                 ///< with verify: fit the start policies again
  std::string export_format;          ///< "csv", "jsonl", "lcm" or empty
  std::string rollout;                ///< RUN:ROLLOUT whose policy is asked for, or empty
  web::PageOptions page;              ///< where it is to be served, or nowhere
  std::string shown;                  ///< RUN:ROLLOUT that is to be shown, or empty
  WorkerProgram worker_program = {};  ///< that simulates it once more
  std::string start;                  ///< condition whose start policy is asked for, or empty
  std::filesystem::path results_dir;  ///< for result files, or empty
  std::vector<std::string> without_workers = {};  ///< ids, or "suspects": fold again without these
  std::filesystem::path new_state_dir = {};       ///< with them: where to
  std::filesystem::path output_file;              ///< of what is asked for; empty: standard output
};

/// Reads a journal, also one that a learner is writing, and changes nothing.
/// Without more: says what is in it, what it has come to and what is missing. verify: recomputes
/// every perturbation and every update from the study and the rewards, checks each record and their
/// chain, each study it was extended from, and compares the result files that lie beside it.
/// The start policies are those that the study holds; refit: they are fitted again and compared.
/// without_workers: without_workers.h. The others: export_rollouts.h, export_messages.h,
/// replayed_policy.h; results_dir: the result files, of what there is.
/// @return  whether all is as it should be; what is not was said on standard error
/// Throws StudyError and ConfigError for bad input, std::runtime_error for what cannot be read or
/// written.
bool replay(const ReplayOptions& options);

}  // namespace treeroll
