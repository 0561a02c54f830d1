#pragma once

#include "learner/app/options.h"

namespace treeroll {

/// Writes a study file of a task to begin with, and says what to do next. The worker executable is
/// asked what the task needs; options.overrides of task.KEY become settings of it. Throws
/// ConfigError for a file that exists (it stays as it is), for what the task refuses, and for a
/// setting that the task requires and nobody has an example of; std::runtime_error if the file
/// cannot be written or the executable not be asked.
void write_new_study(const LearnerOptions& options);

}  // namespace treeroll
