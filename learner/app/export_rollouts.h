#pragma once

#include <filesystem>

#include "learner/state/state_study.h"

namespace treeroll {

/// Writes a row a roll-out, in the order in which the results were applied, and of each evaluation
/// of a run's policy, which has a negative number. Columns of the CSV, keys of the JSON lines:
///
///   condition, repetition, run, rollout, layer, reward, status
///   reason            why it failed
///   duration_s        wall time of the evaluation
///   worker, host, pid  who evaluated
///   learner           which incarnation accepted it
///   reward_slope      (3-7), of the rewards in the window of this layer, this one included
///   theta             theta~ as it was executed
///   mean, noise_deviations  of what theta~ was drawn from: its mean, and the root of its variances
///
/// A list is "1;2.5" in CSV, an array in JSON. Numbers in their shortest exact form. What does not
/// exist is an empty field or null: the slope before two rewards, mean and noise of an evaluation,
/// what a journal of an earlier version does not tell. Results that wait for others of lower
/// numbers stand last, without a slope.
/// @param output_file  empty: standard output
/// Throws as fold_state(), and std::runtime_error for what cannot be written.
void export_rollouts(const StateFiles& files, bool as_json,
                     const std::filesystem::path& output_file);

}  // namespace treeroll
