#pragma once

#include <filesystem>
#include <string>

#include "common/protocol/messages.h"
#include "learner/state/state_study.h"

namespace treeroll {

/// "RUN:ROLLOUT". Throws ConfigError under `option` for anything else, and for a run that a study
/// of so many has not.
protocol::RolloutKey read_rollout_key(const std::string& option, const std::string& rollout,
                                      int num_runs);

/// Writes the policy that a roll-out executed, or will, as a policy file: what crashed a simulator,
/// say. The roll-out may be any that the journal has a result of, or that is under way at its end.
/// @param rollout      "RUN:ROLLOUT"; roll-out -1 is the final policy
/// @param output_file  empty: standard output
/// Throws ConfigError for a roll-out that is not there, std::runtime_error for the rest.
void write_policy_of_rollout(const StateFiles& files, const std::string& rollout,
                             const std::filesystem::path& output_file);

/// The same of the policy that a condition begins with.
void write_start_policy(const StateFiles& files, const std::string& condition,
                        const std::filesystem::path& output_file);

}  // namespace treeroll
