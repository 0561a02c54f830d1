#pragma once

#include <filesystem>
#include <set>

#include "learner/core/recheck_record.h"
#include "learner/state/state_study.h"

namespace treeroll {

/// Who was outvoted: its results are not to be trusted.
std::set<protocol::WorkerId> suspects_of(const RecheckRecord& rechecks);

/// suspects.csv: a row a result of a worker that was outvoted, in the journal's order; no file
/// where none was.
///   condition,repetition,run,rollout,reward,status,worker,host,pid
/// @param directory  of the file
/// Throws std::runtime_error naming the file that cannot be read or written.
void write_suspects(const StateFiles& files, const StateStudy& state, const RecheckRecord& rechecks,
                    const std::filesystem::path& directory);

}  // namespace treeroll
