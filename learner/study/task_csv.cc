#include "learner/study/task_csv.h"

#include <nlohmann/json.hpp>
#include <vector>

#include "common/base/config_error.h"
#include "learner/fit/csv_demonstration.h"
#include "learner/study/demonstration_file.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::size_t kColumnsMax = 33;

std::vector<std::string> columns_of(const json& table, const std::string& path) {
  const auto found = table.find("columns");
  const std::string key = path + ".columns";
  if (found == table.end()) {
    throw ConfigError(key, "", "is required beside csv_file: the columns of the file to take");
  }
  std::vector<std::string> columns;
  if (found->is_array()) {
    for (const json& name : *found) {
      if (name.is_string()) columns.push_back(name.get<std::string>());
    }
  }
  if (columns.empty() || columns.size() != found->size() || columns.size() > kColumnsMax) {
    throw ConfigError(key, found->dump(),
                      "must be a list of 1 to " + std::to_string(kColumnsMax) + " names");
  }
  return columns;
}

void embed(const FilePlace& place, const std::string& path, json& table) {
  const auto file = table.find("csv_file");
  if (file != table.end()) {
    const std::string key = path + ".csv_file";
    if (!file->is_string()) throw ConfigError(key, file->dump(), "must be a string");
    if (table.contains("rows")) throw ConfigError(key, file->dump(), "must not stand beside rows");
    const auto name = file->get<std::string>();
    const std::vector<std::string> columns = columns_of(table, path);
    Eigen::MatrixXd data;
    try {
      data = parse_demonstration(read_demonstration_file(place(key, name).string()), name, columns);
    } catch (const DemonstrationError& error) {
      throw ConfigError(key, file->dump(), error.what());
    }
    if (data.cols() == 0) throw ConfigError(key, file->dump(), "holds no numbers");
    json rows = json::array();
    for (Eigen::Index row = 0; row < data.cols(); ++row) {
      rows.push_back(std::vector<double>(data.col(row).begin(), data.col(row).end()));
    }
    table.erase("csv_file");
    table["rows"] = std::move(rows);
  }
  for (auto& [key, value] : table.items()) {
    if (value.is_object()) embed(place, path + "." + key, value);
  }
}

}  // namespace

void embed_task_csv(const FilePlace& place, json& task) {
  if (task.is_object()) embed(place, "task", task);
}

}  // namespace treeroll
