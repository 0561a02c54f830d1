#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace treeroll {

/// Where the file of a setting lies: its dotted key and what stands there.
using FilePlace =
    std::function<std::filesystem::path(const std::string& key, const std::string& file)>;

/// Data of a task that a CSV file holds. A table in [task], however deep, that names one
///
///   columns = ["t", "x"]
///   csv_file = "goal.csv"
///
/// has the numbers of these columns in its place, row by row, so that neither a worker nor the
/// resolved study needs the file:
///
///   columns = ["t", "x"]
///   rows = [[0.0, 0.1], [0.1, 0.3]]
///
/// The learner knows no task: what the numbers mean, and whether there may be any, is the task's to
/// say. Throws ConfigError that names the key, the file and its line.
void embed_task_csv(const FilePlace& place, nlohmann::json& task);

}  // namespace treeroll
