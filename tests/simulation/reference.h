#pragma once

#include <vector>

#include "learner/core/run_record.h"
#include "learner/core/study.h"
#include "learner/journal/journal_record.h"
#include "tests/simulation/virtual_task.h"

namespace treeroll::simulation {

/// What each run must come to in order "sequence": every roll-out drawn, evaluated and applied one
/// after the other, without a network.
/// @param ends  by run, how many of its results were applied when the study's time was up; empty:
/// it
///              never was
std::vector<RunRecord> faultless_records(const Study& study, const VirtualTask& task,
                                         const std::vector<int>& ends);
/// What each run must come to in any order: a new learner told what the journal holds.
std::vector<RunRecord> folded_records(const Study& study,
                                      const std::vector<JournalRecord>& journal);

/// The same rewards, layers, statuses, switches and best policy.
bool same(const RunRecord& a, const RunRecord& b);

}  // namespace treeroll::simulation
