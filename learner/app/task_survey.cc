#include "learner/app/task_survey.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "learner/app/process.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds kLimit{30};
constexpr int kNestingMax = 64;

}  // namespace

TaskFacts describe_task(const std::string& content, const std::filesystem::path& worker_program) {
  Result<ProgramOutput> answer = run_program(worker_program, {"--describe-task"}, content, kLimit);
  if (!answer) throw std::runtime_error("cannot ask about the task: " + answer.error().message);
  const Result<json> parsed = parse_json(answer->output, kNestingMax);
  const json said = parsed ? *parsed : json();
  const std::string unusable =
      fmt::format("{} --describe-task ended with status {} and said nothing that can be read",
                  worker_program.string(), answer->exit_status);
  if (!said.is_object()) throw std::runtime_error(unusable);
  if (const auto error = said.find("error"); error != said.end()) {
    const auto text = [&](const char* name, const char* otherwise) -> std::string {
      if (!error->is_object()) throw std::runtime_error(unusable);
      const auto value = error->find(name);
      if (value == error->end()) return otherwise;
      if (!value->is_string()) throw std::runtime_error(unusable);
      return *value;
    };
    throw ConfigError(text("key", "task"), text("value", ""), text("rule", "is refused"));
  }
  if (answer->exit_status != 0 || !said.contains("description")) throw std::runtime_error(unusable);
  Result<TaskFacts> facts = task_facts_from_json(said["description"].dump());
  if (!facts) throw ConfigError("task", "", facts.error().message);
  return *facts;
}

std::map<std::string, TaskFacts> survey_tasks(const LoadedStudy& loaded,
                                              const LearnerOptions& options) {
  if (access(options.worker_program.c_str(), X_OK) != 0) {
    if (!options.needs_worker_program) return {};
    throw ConfigError("--worker-program", options.worker_program.string(),
                      fmt::format("cannot be executed: {}", std::strerror(errno)));
  }
  std::map<std::string, TaskFacts> known;
  std::set<std::string> asked;
  for (std::size_t c = 0; c < loaded.study.conditions.size(); ++c) {
    const std::string& content = loaded.study.conditions[c].task_content;
    if (asked.insert(content).second) {
      try {
        known[content] = describe_task(content, options.worker_program);
      } catch (const ConfigError& error) {
        if (error.key() == "task.name" && !options.needs_worker_program) continue;
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
