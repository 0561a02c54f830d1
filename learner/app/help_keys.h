#pragma once

#include <string>

#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// Prints every key of a study that fits the pattern (settings_reference.h), as Markdown: those of
/// the tasks are the worker executable's. Throws std::runtime_error if that cannot be asked.
void print_keys(const std::string& pattern, const WorkerProgram& worker_program);

}  // namespace treeroll
