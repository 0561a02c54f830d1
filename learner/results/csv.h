#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "learner/core/run_record.h"

/// The tables of a study as CSV (RFC 4180 with "\n"): a header line, then rows sorted by condition
/// in the study's order, repetition and roll-out, whatever the order of `runs`. Numbers in their
/// shortest exact form, so that equal outcomes give equal bytes.
namespace treeroll {

/// condition,repetition,run,rollout,layer,reward,status: a row an applied roll-out. In arrival
/// order a roll-out without a result yet has layer 0 in its record: it has no row.
/// Throws std::runtime_error naming the file if it cannot be written.
void write_rollouts_csv(const std::filesystem::path& path, const std::vector<RunRecord>& runs);

/// condition,repetition,run,rollouts,best_reward,final_reward,rollouts_before_switch,failed,switches:
/// a row a run. rollouts_before_switch counts, for each switch, the roll-outs up to the one after
/// whose result the layer was left, with ";" between: "65;131". A figure that does not exist is an
/// empty field. Throws std::runtime_error naming the file if it cannot be written.
void write_runs_csv(const std::filesystem::path& path, const std::vector<RunRecord>& runs);

}  // namespace treeroll
