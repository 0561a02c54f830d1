#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/core/run_record.h"

namespace treeroll {

class TaskRegistry;

/// Learns a study in this process, without ledger, network and workers: the plainest reading of a
/// study, and what the service must give to the bit. All runs to their end, each roll-out by
/// roll-out; those of one task go side by side, and their roll-outs are evaluated together.
std::vector<RunRecord> run_study(const std::filesystem::path& study,
                                 const std::vector<std::string>& overrides);
/// The same of tasks of one's own.
std::vector<RunRecord> run_study(const std::filesystem::path& study,
                                 const std::vector<std::string>& overrides,
                                 const TaskRegistry& registry);

/// The runs of one condition.
std::vector<RunRecord> of_condition(const std::vector<RunRecord>& runs, const std::string& name);

/// Mean over the runs of their best reward.
double mean_best(const std::vector<RunRecord>& runs);

/// Mean over the runs of the reward near roll-out n: of the five roll-outs up to it.
double mean_near(const std::vector<RunRecord>& runs, int n);

}  // namespace treeroll
