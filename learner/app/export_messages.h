#pragma once

#include <filesystem>
#include <string_view>

#include "learner/state/state_study.h"

namespace treeroll {

/// Before the channel of each message of an exported study. Nobody listens there but who means to,
/// and no pattern that begins with treeroll's own names matches. So no worker can take a roll-out
/// of the past for one that is asked of it, no robot a policy of the past for the best so far, and
/// no learner an old answer for a new one.
inline constexpr std::string_view kReplayedPrefix = "REPLAYED_";

/// Writes what the journal tells as the messages that its learner and workers might have sent, in
/// LCM's log format: lcm-logplayer plays it, lcm-spy and any subscriber know the types. Numbers and
/// ids are the journal's, and each message has the time at which its record was written.
///
///   start of a learner  learner_status_t
///   worker              worker_status_t
///   result              definition_piece_t of a task, policy or theta that is new; rollout_batch_t
///                       with the roll-out, right before its answer, as nobody has written down
///                       when it was asked for; reward_batch_t
///   result applied      run_status_t; best_policy_t if it is the run's best
///   a record, once a second, and the end
///                       learner_status_t; at the end worker_status_t with what each has done
///
/// What a journal does not tell is 0 or empty: the learner's host, evaluators, what was sent again.
/// @param output_file  empty: standard output
/// Throws as fold_state(), and std::runtime_error for what cannot be written.
void export_messages(const StateFiles& files, const std::filesystem::path& output_file);

}  // namespace treeroll
