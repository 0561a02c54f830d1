#include "learner/app/task_survey.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "common/base/config_error.h"
#include "learner/app/process.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds kLimit{30};

/// Nothing if the executable does not know the task's name.
std::optional<TaskFacts> ask(const std::string& content, const std::filesystem::path& program) {
  Result<ProgramOutput> answer = run_program(program, {"--describe-task"}, content, kLimit);
  if (!answer) throw std::runtime_error("cannot ask about the task: " + answer.error().message);
  const json said = json::parse(answer->output, nullptr, /*allow_exceptions=*/false);
  const std::string unusable =
      fmt::format("{} --describe-task ended with status {} and said nothing that can be read",
                  program.string(), answer->exit_status);
  if (!said.is_object()) throw std::runtime_error(unusable);
  if (const auto error = said.find("error"); error != said.end()) {
    if (!error->is_object()) throw std::runtime_error(unusable);
    const std::string key = error->value("key", "task");
    if (key == "task.name") return std::nullopt;
    throw ConfigError(key, error->value("value", ""), error->value("rule", "is refused"));
  }
  if (answer->exit_status != 0 || !said.contains("description")) throw std::runtime_error(unusable);
  Result<TaskFacts> facts = task_facts_from_json(said["description"].dump());
  if (!facts) throw ConfigError("task", "", facts.error().message);
  return *facts;
}

}  // namespace

std::map<std::string, TaskFacts> survey_tasks(const Study& study,
                                              const std::filesystem::path& worker_program) {
  std::map<std::string, std::optional<TaskFacts>> asked;
  for (const Condition& condition : study.conditions) {
    if (!asked.contains(condition.task_content)) {
      asked[condition.task_content] = ask(condition.task_content, worker_program);
    }
  }
  std::map<std::string, TaskFacts> known;
  for (const auto& [content, facts] : asked) {
    if (facts) known[content] = *facts;
  }
  return known;
}

}  // namespace treeroll
