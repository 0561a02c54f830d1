#pragma once

#include <filesystem>

#include "learner/core/recheck_record.h"
#include "learner/journal/journal_file.h"

namespace treeroll {

/// What a journal holds of roll-outs that were run again (study.recheck), without the study.
/// An error as of read_journal().
Result<RecheckRecord> rechecks_of(const std::filesystem::path& journal);

}  // namespace treeroll
