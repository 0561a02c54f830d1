#pragma once

#include <filesystem>

#include "learner/results/study_results.h"

namespace treeroll::report {

/// What a study has come to: by its result files if a learner has written them and ended, or if
/// there is no journal; else by its journal, which a learner may be writing.
/// Throws as read_study_results(), read_state_study() and fold_state() do.
StudyResults read_state_results(const std::filesystem::path& directory);

}  // namespace treeroll::report
