#include "learner/worker_program/worker_program.h"

#include "common/base/config_error.h"
#include "common/program/program_command.h"
#include "learner/worker_program/process.h"

namespace treeroll {

void check_executable(const WorkerProgram& program) {
  if (can_be_executed(program.path)) return;
  throw ConfigError(kWorkerProgramOption, program.path.string(),
                    "must be a program that can be executed");
}

void check_and_complete(WorkerProgram& given) {
  if (!given.evaluator.empty()) {
    static_cast<void>(read_program_command(kEvaluatorOption, given.evaluator));
  }
  if (given.path.empty()) {
    given.path = program_beside_us("treeroll-worker");
  } else {
    check_executable(given);
  }
}

}  // namespace treeroll
