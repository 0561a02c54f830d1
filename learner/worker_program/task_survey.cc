#include "learner/worker_program/task_survey.h"

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/program/program_command.h"
#include "common/task_facts/task_agreement.h"
#include "learner/study/task_table.h"
#include "learner/worker_program/process.h"
#include "learner/worker_program/program_answer.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// What a study file holds stays below its own limit of 32 tables.
constexpr int kSettingsNestingMax = 16;
constexpr std::uint64_t kIntegerMax = std::numeric_limits<std::int64_t>::max();

/// The settings come from a user's program: they must be such as a study file can hold.
void check_settings(const json& settings, const std::string& path, int depth) {
  if (settings.is_null()) throw ConfigError(path, "null", "a task's settings must have values");
  if (depth > kSettingsNestingMax) throw ConfigError(path, "", "is nested too deeply");
  if (settings.is_string() &&
      settings.get_ref<const std::string&>().find('\0') != std::string::npos) {
    throw ConfigError(path, "", "must not hold a NUL character");
  }
  if (settings.is_number_unsigned() && settings.get<std::uint64_t>() > kIntegerMax) {
    throw ConfigError(path, settings.dump(), "must be an integer of 63 bits");
  }
  for (const auto& [key, value] : settings.items()) {
    if (settings.is_structured()) {
      check_settings(value, settings.is_object() ? path + "." + key : path, depth + 1);
    }
  }
}

}  // namespace

DescribedTask describe_task(const std::string& content, const WorkerProgram& worker_program) {
  Result<ProgramOutput> answer =
      run_program(worker_program.path, worker_program.arguments({"--describe-task"}), content,
                  kDescriptionLimit);
  if (!answer) throw std::runtime_error("cannot ask about the task: " + answer.error().message);
  const std::string unusable =
      fmt::format("{} --describe-task ended with status {} and said nothing that can be read",
                  worker_program.path.string(), answer->exit_status);
  const json said = read_program_answer(answer->output, "task", unusable);
  if (answer->exit_status != 0 || !said.contains("description")) throw std::runtime_error(unusable);
  Result<TaskDescription> facts = task_description_from_json(said["description"].dump());
  if (!facts) throw ConfigError("task", "", facts.error().message);
  if (!said.contains("settings") || !said["settings"].is_object()) {
    throw std::runtime_error(unusable);
  }
  for (const char* ours : {"name", "described"}) {
    if (said["settings"].contains(ours)) {
      throw ConfigError(std::string("task.") + ours, "",
                        "must be no setting of a task: it is ours");
    }
  }
  check_settings(said["settings"], "task", 0);
  check_agreement(json::parse(content), said["settings"], *facts);
  return {*facts, said["settings"].dump()};
}

std::optional<TaskDescription> describe_repeatable(const std::string& content,
                                                   const WorkerProgram& worker_program) {
  std::optional<TaskDescription> task = described_in(content);
  if (!task || task->repeatable) task = describe_task(content, worker_program).description;
  if (!task->repeatable) return std::nullopt;
  return task;
}

std::map<std::string, DescribedTask> survey_tasks(const LoadedStudy& loaded,
                                                  const WorkerProgram& worker_program,
                                                  bool is_needed) {
  if (!is_needed && !can_be_executed(worker_program.path)) return {};
  check_executable(worker_program);
  std::map<std::string, DescribedTask> known;
  std::set<std::string> asked;
  for (std::size_t c = 0; c < loaded.study.conditions.size(); ++c) {
    const std::string& content = loaded.study.conditions[c].task_content;
    if (asked.insert(content).second) {
      try {
        known[content] = describe_task(content, worker_program);
      } catch (const ConfigError& error) {
        if (error.key() == "task.name" && !is_needed) continue;
        throw condition_error(loaded, c, error);
      }
    }
    if (const auto facts = known.find(content); facts != known.end()) {
      const TaskDescription& task = facts->second.description;
      check_task(loaded, c, {task.input_dim, task.output_dim, task.signals});
    }
  }
  return known;
}

std::map<std::string, TaskDescription> resolve_tasks(
    LoadedStudy& loaded, const std::map<std::string, DescribedTask>& described) {
  std::map<std::string, TaskDescription> resolved;
  for (std::size_t c = 0; c < loaded.study.conditions.size(); ++c) {
    const auto task = described.find(loaded.study.conditions[c].task_content);
    if (task == described.end()) continue;
    resolve_task(loaded, c, task->second.settings, task->second.description);
    resolved[loaded.study.conditions[c].task_content] = task->second.description;
  }
  return resolved;
}

std::map<std::string, TaskDescription> descriptions_of(
    const std::map<std::string, DescribedTask>& described) {
  std::map<std::string, TaskDescription> descriptions;
  for (const auto& [content, task] : described) descriptions[content] = task.description;
  return descriptions;
}

}  // namespace treeroll
