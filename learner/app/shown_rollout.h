#pragma once

#include <filesystem>
#include <string>

#include "learner/state/state_study.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// Prints one roll-out with all that is to be seen of it, as one JSON object: its policy and the
/// one that it was drawn around, with the noise; what came of it; and step by step how it went,
/// which a worker executable simulates once more, with the seed of its task. A task that says
/// repeatable = false is not run for that.
/// @param rollout  "RUN:ROLLOUT"; -2 the start policy, -1 the final one
/// Throws ConfigError for what is no roll-out of the journal, std::runtime_error for a journal that
/// cannot be read. What the worker executable cannot do is said in the object. Where the user's
/// program (--evaluator) cannot be asked, it is thrown too, once the object is printed.
void show_rollout(const StateFiles& files, const std::string& rollout,
                  const WorkerProgram& worker_program, const std::filesystem::path& output_file);

}  // namespace treeroll
