#include "learner/app/help_keys.h"

#include <fmt/format.h>

#include <cstdio>
#include <stdexcept>

#include "common/program/standard_output.h"
#include "learner/study/study_reference.h"
#include "learner/worker_program/process.h"

namespace treeroll {

void print_keys(const std::string& pattern, const WorkerProgram& worker_program) {
  fmt::print("# The keys of a study\n\n");
  for (const StudyTableReference& table : study_reference()) {
    fmt::print("{}", reference_part(table.heading, table.keys, pattern));
  }
  // Written before the worker writes.
  std::fflush(stdout);
  const Result<ProgramOutput> tasks =
      run_program(worker_program.path, {"--help-tasks", pattern}, "", kDescriptionLimit);
  if (!tasks || tasks->exit_status != 0) {
    throw std::runtime_error(fmt::format(
        "the keys of tasks cannot be asked for: {} --help-tasks {}", worker_program.path.string(),
        tasks ? fmt::format("ended with status {}", tasks->exit_status) : tasks.error().message));
  }
  fmt::print("{}", tasks->output);
  flush_standard_output();
}

}  // namespace treeroll
