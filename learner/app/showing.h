#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "learner/web/rollout_shower.h"
#include "learner/worker_program/process.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// What a page shows a roll-out with: treeroll-replay beside this program.
/// @param where  a state directory or a journal
inline web::ShowingProgram showing_program(const std::filesystem::path& where,
                                           const WorkerProgram& worker) {
  std::vector<std::string> arguments = worker.arguments({where.string()});
  // That beside it is also beside us, if it is there.
  if (worker.path != program_beside_us("treeroll-worker")) {
    arguments.insert(arguments.end(), {kWorkerProgramOption, worker.path.string()});
  }
  arguments.emplace_back("--show");
  return {program_beside_us("treeroll-replay"), std::move(arguments)};
}

}  // namespace treeroll
