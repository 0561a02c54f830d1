#include "learner/study/study_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/protocol/limits.h"
#include "common/settings/settings_reader.h"
#include "learner/explore/exploration_settings.h"
#include "learner/study/message_sizes.h"
#include "learner/study/policy_cache.h"
#include "learner/study/policy_file.h"
#include "learner/study/study_document.h"
#include "learner/study/study_table.h"
#include "learner/study/task_csv.h"
#include "learner/study/task_table.h"

namespace treeroll {
namespace {

using nlohmann::json;

using protocol::kInFlightTotalMax;
using protocol::kRolloutsTotalMax;
using protocol::kRunsMax;

/// A path in the study file is relative to that file's folder, one of the command line to the
/// current one.
std::filesystem::path path_of(const std::filesystem::path& study_file,
                              const SettingOrigins& origins, const std::string& key,
                              const std::filesystem::path& path) {
  const bool is_of_study = path.is_relative() && origin_of(origins, key) != kCommandLineOrigin;
  return is_of_study ? study_file.parent_path() / path : path;
}

/// policy.start_file, read into policy.given: the resolved study then needs no other file.
void read_start_file(const std::filesystem::path& study_file, const SettingOrigins& origins,
                     const PolicyRegistry& policies, json& policy) {
  constexpr const char* kKey = "policy.start_file";
  json scratch;
  SettingsReader reader(policy, "policy", scratch);
  const auto name = read_start_file_name(reader);
  if (!name) return;
  const std::filesystem::path path = path_of(study_file, origins, kKey, *name);
  const PolicyFile file = read_policy_file(kKey, path, policies);
  policy[kGivenPolicy] = to_json(*file.policy, file.signals);
  policy.erase("start_file");
}

explore::ExplorationSettings read_exploration(const json& settings, const Policy& policy,
                                              StudyBudget budget, explore::StartWork work,
                                              json& resolved) {
  SettingsReader reader(settings, "exploration", resolved);
  explore::ExplorationSettings exploration =
      explore::read_exploration_settings(reader, policy, explore::standard_update_rules(), work);
  reader.finish();
  exploration.num_rollouts = budget.num_rollouts;
  exploration.in_flight = budget.in_flight;
  return exploration;
}

ConfigError in_condition(const ConfigError& error, const std::string& condition) {
  return {error.key(), error.value(), fmt::format("{} (condition {})", error.rule(), condition)};
}

/// Files of a demonstration that are named relatively stand beside the study, wherever it is loaded
/// from. What is no list of names is left for others to refuse.
void find_demonstration_files(const std::filesystem::path& directory, json& settings) {
  const json::json_pointer where("/policy/demonstration/files");
  if (!settings.contains(where) || !settings[where].is_array()) return;
  for (json& file : settings[where]) {
    if (!file.is_string()) continue;
    // Joined first: the folder of a study named without one is empty, which has no absolute path.
    file =
        std::filesystem::absolute(directory / file.get<std::string>()).lexically_normal().string();
  }
}

/// The names that a demonstration's columns have, inputs before outputs; none without files.
std::vector<std::string> demonstration_columns(const json& policy) {
  std::vector<std::string> columns;
  for (const char* key : {"/demonstration/inputs", "/demonstration/outputs"}) {
    const json::json_pointer where(key);
    if (!policy.contains(where)) continue;
    for (const json& name : policy[where]) columns.push_back(name.get<std::string>());
  }
  return columns;
}

int form_of(const StudyDocument& document, int form_unsaid) {
  const json& attached = document.attached();
  return attached.contains("written_by") ? attached["written_by"]["format"].get<int>()
                                         : form_unsaid;
}

/// Reads the conditions of a document one after the other.
class StudyBuilder {
 public:
  StudyBuilder(std::filesystem::path file, const StudyDocument& document,
               const PolicyRegistry& policies, StoredStarts starts, int form_unsaid,
               explore::StartWork work)
      : file_(std::move(file)),
        document_(document),
        registry_(policies),
        policies_(policies, stored_, starts, form_of(document, form_unsaid)),
        work_(work) {
    const json& attached = document.attached();
    try {
      if (attached.contains("demonstrations")) {
        stored_.read_demonstrations(attached["demonstrations"]);
      }
      if (attached.contains("starts")) stored_.read_starts(attached["starts"]);
    } catch (const ConfigError& error) {
      throw StudyError(origin_of(document.attached_origins(), error.key()), error);
    }
  }

  void add_condition(std::size_t index) {
    json settings;
    SettingOrigins origins = document_.settings(index, settings);
    find_demonstration_files(file_.parent_path(), settings);
    const std::string& name = document_.name(index);
    try {
      forget_description(origins, settings.at("task"));
      read_start_file(file_, origins, registry_, settings.at("policy"));
      check_beside_given(settings.at("policy"));
      embed_task_csv([&](const std::string& key,
                         const std::string& file) { return path_of(file_, origins, key, file); },
                     settings.at("task"));
      loaded_.study.conditions.push_back(read(name, settings));
    } catch (const ConfigError& error) {
      throw StudyError(origin_of(origins, error.key()), in_condition(error, name));
    } catch (const std::invalid_argument& error) {
      // A policy that cannot be, from settings that are each within their bounds.
      throw StudyError(origin_of(origins, "policy"),
                       in_condition(ConfigError("policy", "", error.what()), name));
    }
    loaded_.origins.push_back(std::move(origins));
  }

  LoadedStudy take() {
    loaded_.text = document_.text();
    loaded_.resolved.study = std::make_shared<json>(study_table_);
    for (const char* grows : {"repetitions", "stop_after_s"}) study_table_.erase(grows);
    loaded_.lasting_id = content_hash(study_table_.dump() + lasting_);
    return std::move(loaded_);
  }

 private:
  /// What stands beside a given policy describes another one and does not count. Conditions that
  /// differ in it would look different and be the same.
  void check_beside_given(const json& policy) {
    if (!policy.contains(kGivenPolicy)) return;
    json beside = policy;
    beside.erase(kGivenPolicy);
    const auto [first, is_new] = beside_given_.try_emplace(policy[kGivenPolicy].dump(), beside);
    const json differences = json::diff(first->second, beside);
    if (is_new || differences.empty()) return;
    const json::json_pointer place(differences[0]["path"].get<std::string>());
    std::string key = "policy" + place.to_string();
    std::replace(key.begin(), key.end(), '/', '.');
    throw ConfigError(key, beside.contains(place) ? beside[place].dump() : "",
                      "must be the same in all conditions that begin with the same "
                      "policy.start_file: beside it, no other key of [policy] counts");
  }

  Condition read(const std::string& name, const json& settings) {
    json study_table;
    SettingsReader reader(settings.at("study"), "study", study_table);
    const StudyBudget budget = read_study_table(reader, loaded_.study);
    reader.finish();
    check_totals(budget);
    TaskTable task = read_task_table(settings.at("task"));
    const ResolvedPolicy& policy = policies_.get(settings.at("policy"));
    json exploration_table;
    Condition condition{
        .name = name,
        .task_content = std::move(task.content),
        .start = policy.start.policy,
        .exploration = read_exploration(settings.at("exploration"), *policy.start.policy, budget,
                                        work_, exploration_table),
        .signals = task.signals.empty() ? policy.signals : task.signals};
    check_message_sizes(condition);
    loaded_.log_likelihoods.push_back(policy.start.log_likelihoods);
    loaded_.demonstrations.push_back(policy.start.demonstration);
    loaded_.columns.push_back(task.signals.empty() ? demonstration_columns(*policy.settings)
                                                   : all_of(task.signals));

    for (const char* own : {"rollouts", "in_flight"}) study_table.erase(own);
    study_table_ = std::move(study_table);
    loaded_.resolved.store.keep(*policy.settings, policy.start);
    json resolved{{"name", name},
                  {"study", {{"rollouts", budget.num_rollouts}, {"in_flight", budget.in_flight}}},
                  {"task", settings.at("task")},
                  {"policy", *policy.settings},
                  {"exploration", exploration_table}};
    keep_resolved(resolved);
    resolved.at("study").erase("rollouts");
    lasting_ += to_hex(content_hash(resolved.dump()));
    return condition;
  }

  void keep_resolved(json condition) {
    add_condition_bytes(condition, resolved_bytes_);
    loaded_.resolved.conditions.push_back(std::make_shared<json>(std::move(condition)));
  }

  void check_totals(StudyBudget budget) {
    const std::int64_t repetitions = loaded_.study.repetitions;
    const auto num_conditions = static_cast<std::int64_t>(document_.num_conditions());
    if (num_conditions * repetitions > kRunsMax) {
      throw ConfigError("study.repetitions", std::to_string(repetitions),
                        fmt::format("{} conditions times {} repetitions: must be at most {} runs",
                                    num_conditions, repetitions, kRunsMax));
    }
    in_flight_ += std::min(budget.num_rollouts, budget.in_flight) * repetitions;
    if (in_flight_ > kInFlightTotalMax) {
      throw ConfigError(
          "study.in_flight", std::to_string(budget.in_flight),
          fmt::format("the roll-outs in flight of all runs must be at most {} together",
                      kInFlightTotalMax));
    }
    num_rollouts_ += budget.num_rollouts * repetitions;
    if (num_rollouts_ > kRolloutsTotalMax) {
      throw ConfigError(
          "study.rollouts", std::to_string(budget.num_rollouts),
          fmt::format("the roll-outs of all runs must be at most {} together", kRolloutsTotalMax));
    }
  }

  std::filesystem::path file_;
  const StudyDocument& document_;
  const PolicyRegistry& registry_;
  StudyStore stored_;  // by an earlier load
  PolicyCache policies_;
  std::map<std::string, json> beside_given_;  ///< by policy: the other keys of its first condition
  LoadedStudy loaded_;
  json study_table_;
  StudyBytes resolved_bytes_;
  std::string lasting_;  // a hash a condition
  explore::StartWork work_;
  std::int64_t num_rollouts_ = 0;
  std::int64_t in_flight_ = 0;
};

/// @param form_unsaid  of a study that does not say its form
LoadedStudy load(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                 const PolicyRegistry& policies, StoredStarts starts, int form_unsaid,
                 explore::StartWork work) {
  const StudyDocument document(file, overrides);
  StudyBuilder builder(file, document, policies, starts, form_unsaid, work);
  for (std::size_t i = 0; i < document.num_conditions(); ++i) builder.add_condition(i);
  return builder.take();
}

}  // namespace

LoadedStudy load_study(const std::filesystem::path& file, const std::vector<std::string>& overrides,
                       const PolicyRegistry& policies, StoredStarts starts) {
  return load(file, overrides, policies, starts, kStudyFormat, explore::StartWork::kBounded);
}

LoadedStudy load_resolved_study(const std::filesystem::path& file,
                                const std::vector<std::string>& overrides, StoredStarts starts) {
  return load(file, overrides, learnable_policies(), starts, 1, explore::StartWork::kAny);
}

StudyError condition_error(const LoadedStudy& loaded, std::size_t condition,
                           const ConfigError& error) {
  return {origin_of(loaded.origins.at(condition), error.key()),
          in_condition(error, loaded.study.conditions.at(condition).name)};
}

void check_task(const LoadedStudy& loaded, std::size_t condition, TaskDims task) {
  const Condition& checked = loaded.study.conditions.at(condition);
  const Policy& policy = *checked.start;
  if (policy.input_dim() != task.input_dim || policy.output_dim() != task.output_dim) {
    throw condition_error(
        loaded, condition,
        ConfigError(
            "policy", "",
            fmt::format("has {} inputs and {} outputs, must have {} inputs and {} outputs for "
                        "this task",
                        policy.input_dim(), policy.output_dim(), task.input_dim, task.output_dim)));
  }
  const json& table = loaded.resolved.conditions.at(condition)->at("task");
  if (table.contains("described")) {
    const auto other = difference(checked.signals, "here they are", task.signals);
    if (!other) return;
    throw condition_error(loaded, condition,
                          ConfigError("task.described", "",
                                      fmt::format("in the study the task's {}: this worker "
                                                  "program's task is another one",
                                                  *other)));
  }
  if (const auto other = difference(checked.signals, "those of the task are", task.signals)) {
    throw condition_error(loaded, condition,
                          ConfigError("policy.start_file", "",
                                      fmt::format("the policy's {}: must be a policy of this "
                                                  "task, or name no signals",
                                                  *other)));
  }
}

}  // namespace treeroll
