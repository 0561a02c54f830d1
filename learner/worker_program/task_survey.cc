#include "learner/worker_program/task_survey.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "learner/worker_program/process.h"
#include "learner/worker_program/program_answer.h"

namespace treeroll {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds kLimit{30};

}  // namespace

TaskDescription describe_task(const std::string& content,
                              const std::filesystem::path& worker_program) {
  Result<ProgramOutput> answer = run_program(worker_program, {"--describe-task"}, content, kLimit);
  if (!answer) throw std::runtime_error("cannot ask about the task: " + answer.error().message);
  const std::string unusable =
      fmt::format("{} --describe-task ended with status {} and said nothing that can be read",
                  worker_program.string(), answer->exit_status);
  const json said = read_program_answer(answer->output, "task", unusable);
  if (answer->exit_status != 0 || !said.contains("description")) throw std::runtime_error(unusable);
  Result<TaskDescription> facts = task_description_from_json(said["description"].dump());
  if (!facts) throw ConfigError("task", "", facts.error().message);
  return *facts;
}

std::map<std::string, TaskDescription> survey_tasks(const LoadedStudy& loaded,
                                                    const std::filesystem::path& worker_program,
                                                    bool is_needed) {
  if (access(worker_program.c_str(), X_OK) != 0) {
    if (!is_needed) return {};
    throw ConfigError("--worker-program", worker_program.string(),
                      fmt::format("cannot be executed: {}", std::strerror(errno)));
  }
  std::map<std::string, TaskDescription> known;
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
      check_task(loaded, c, {facts->second.input_dim, facts->second.output_dim});
    }
  }
  return known;
}

}  // namespace treeroll
