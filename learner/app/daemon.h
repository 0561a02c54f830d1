#pragma once

#include "learner/app/options.h"

namespace treeroll {

/// Exit statuses of treeroll-learner.
inline constexpr int kExitDone = 0;
inline constexpr int kExitOther = 1;
inline constexpr int kExitBadInput = 2;
inline constexpr int kExitStopped = 3;  ///< early, on request; --resume goes on

/// Learns a study, a new one or one that was interrupted: loads and checks it, opens the bus, folds
/// what the journal holds, starts local workers, runs the core until every run is done or it is
/// asked to stop, writes the state directory and prints the summary.
/// @return the exit status. Throws StudyError and ConfigError for bad input, std::runtime_error for
/// anything else; main reports them.
int run_learner(const LearnerOptions& options);

}  // namespace treeroll
