#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/state/state_study.h"

namespace treeroll {

/// Folds a study again without the results of some workers, into a state directory of its own, and
/// says what has changed. A learner goes on there: it learns the rest again.
/// @param workers    ids, or "suspects": those that others have outvoted (study.recheck)
/// @param directory  new or empty
/// Throws ConfigError for who is no worker of the journal, std::runtime_error for what cannot be
/// read or written.
void fold_without_workers(const StateFiles& files, const std::vector<std::string>& workers,
                          const std::filesystem::path& directory);

}  // namespace treeroll
