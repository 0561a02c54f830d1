#include "learner/app/task_survey.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "learner/app/process.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds kLimit{30};

}  // namespace

std::optional<TaskFacts> describe_task(const std::string& content,
                                       const std::filesystem::path& worker_program) {
  Result<ProgramOutput> answer = run_program(worker_program, {"--describe-task"}, content, kLimit);
  if (!answer) throw std::runtime_error("cannot ask about the task: " + answer.error().message);
  const json said = json::parse(answer->output, nullptr, /*allow_exceptions=*/false);
  const std::string unusable =
      fmt::format("{} --describe-task ended with status {} and said nothing that can be read",
                  worker_program.string(), answer->exit_status);
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

std::map<std::string, TaskFacts> survey_tasks(const LoadedStudy& loaded,
                                              const std::filesystem::path& worker_program) {
  std::map<std::string, TaskFacts> known;
  std::set<std::string> asked;
  for (std::size_t c = 0; c < loaded.study.conditions.size(); ++c) {
    const std::string& content = loaded.study.conditions[c].task_content;
    if (asked.insert(content).second) {
      try {
        if (const std::optional<TaskFacts> facts = describe_task(content, worker_program)) {
          known[content] = *facts;
        }
      } catch (const ConfigError& error) {
        throw condition_error(loaded, c, error);
      }
    }
    if (const auto facts = known.find(content); facts != known.end()) {
      check_task(loaded, c, {facts->second.input_dim, facts->second.output_dim});
    }
  }
  return known;
}

}  // namespace treeroll
