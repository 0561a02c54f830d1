#pragma once

#include <filesystem>

#include "learner/state/state_study.h"
#include "learner/web/page_options.h"
#include "learner/worker_program/worker_program.h"

namespace treeroll {

/// Serves the page of a journal, at rest or growing, until a signal asks for the end. Nothing is
/// written.
/// Throws ConfigError for an address that cannot be had, std::runtime_error for a journal that
/// cannot be read.
void serve_journal(const StateFiles& files, const web::PageOptions& page,
                   const WorkerProgram& worker_program);

}  // namespace treeroll
