#include "learner/app/evaluate.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/rollout_status.h"
#include "common/files/atomic_file.h"
#include "common/program/standard_output.h"
#include "learner/results/csv.h"
#include "learner/study/policy_file.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/task_survey.h"
#include "learner/worker_program/worker_evaluation.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

void check_paths(const EvaluateOptions& options) {
  if (access(options.worker_program.c_str(), X_OK) != 0 ||
      fs::is_directory(options.worker_program)) {
    throw ConfigError("--worker-program", options.worker_program.string(),
                      "must be a program that can be executed");
  }
  if (options.trace_file.empty()) return;
  const fs::path folder = options.trace_file.parent_path();
  if (fs::is_directory(options.trace_file) || !options.trace_file.has_filename() ||
      !fs::is_directory(folder.empty() ? "." : folder)) {
    throw ConfigError("--trace", options.trace_file.string(),
                      "must be a file in a folder there is");
  }
}

/// Index of the condition whose task counts.
std::size_t choose_condition(const Study& study, const std::string& name) {
  std::string known;
  bool share_a_task = true;
  for (std::size_t c = 0; c < study.conditions.size(); ++c) {
    if (study.conditions[c].name == name) return c;
    known += (c == 0 ? "" : ", ") + study.conditions[c].name;
    share_a_task =
        share_a_task && study.conditions[c].task_content == study.conditions.front().task_content;
  }
  if (!name.empty()) {
    throw ConfigError("--condition", name, "must be a condition of the study: " + known);
  }
  if (!share_a_task) {
    throw ConfigError("--condition", "",
                      "must be given, for the conditions have different tasks: " + known);
  }
  return 0;
}

void check_dims(const Policy& policy, const TaskDescription& task, const fs::path& file) {
  if (policy.input_dim() == task.input_dim && policy.output_dim() == task.output_dim) return;
  throw ConfigError(
      "POLICY", file.string(),
      fmt::format("has {} inputs and {} outputs, must have {} inputs and {} outputs "
                  "for this task",
                  policy.input_dim(), policy.output_dim(), task.input_dim, task.output_dim));
}

void write_trace(const fs::path& path, const RolloutTrace& trace) {
  AtomicFile file(path);
  const std::size_t width = trace.columns.size();
  for (std::size_t i = 0; i < width; ++i) {
    file.append(csv_field(trace.columns[i]));
    file.append(i + 1 < width ? "," : "\n");
  }
  for (std::size_t i = 0; i < trace.numbers.size(); ++i) {
    if (std::isfinite(trace.numbers[i])) file.append(fmt::format("{}", trace.numbers[i]));
    file.append((i + 1) % width != 0 ? "," : "\n");
  }
  file.commit();
}

}  // namespace

void evaluate_policy(const EvaluateOptions& options) {
  check_paths(options);
  const PolicyFile file = read_policy_file("POLICY", options.policy_file, learnable_policies());
  const LoadedStudy loaded = load_study(options.study_file, options.overrides);
  const std::size_t chosen = choose_condition(loaded.study, options.condition);
  const Condition& condition = loaded.study.conditions[chosen];
  const TaskDescription task = [&] {
    try {
      return describe_task(condition.task_content, options.worker_program).description;
    } catch (const ConfigError& error) {
      throw condition_error(loaded, chosen, error);
    }
  }();
  check_dims(*file.policy, task, options.policy_file);

  const PolicyEvaluation outcome = evaluate_with(options.worker_program, task,
                                                 {.task_content = condition.task_content,
                                                  .policy_text = file.text,
                                                  .seed = options.seed,
                                                  .trace = !options.trace_file.empty()});
  if (!outcome.complaint.empty()) spdlog::warn("{}", outcome.complaint);
  if (!options.trace_file.empty()) {
    if (outcome.trace.columns.empty() && outcome.status == name(RolloutStatus::kOk)) {
      throw ConfigError("--trace", options.trace_file.string(), "this task records no trace");
    }
    if (!outcome.trace.columns.empty()) write_trace(options.trace_file, outcome.trace);
  }
  const std::string task_name = json::parse(condition.task_content)["name"].get<std::string>();
  if (options.json) {
    const json said{{"policy", options.policy_file.string()},
                    {"condition", condition.name},
                    {"task", task_name},
                    {"reward", outcome.reward},
                    {"status", outcome.status}};
    fmt::print("{}\n", said.dump(-1, ' ', false, json::error_handler_t::replace));
  } else {
    fmt::print("task    {}\nreward  {}\nstatus  {}\n", task_name, outcome.reward, outcome.status);
  }
  flush_standard_output();
}

}  // namespace treeroll
