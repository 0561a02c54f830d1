#pragma once

#include "learner/app/options.h"

namespace treeroll {

/// Exit status of treeroll-learner beside those of common/program/program.h: early, on request;
/// --resume goes on.
inline constexpr int kExitStopped = 3;
/// No roll-out of the study had a positive reward.
inline constexpr int kExitNothingLearnt = 4;

/// Learns a study, a new one or one that was interrupted: loads and checks it, opens the bus, folds
/// what the journal holds, starts local workers, runs the core until every run is done or it is
/// asked to stop, writes the state directory and prints the summary.
/// @return the exit status. Throws StudyError and ConfigError for bad input, std::runtime_error for
/// anything else; main reports them.
int run_learner(const LearnerOptions& options);

}  // namespace treeroll
