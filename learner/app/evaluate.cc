#include "learner/app/evaluate.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/rollout_status.h"
#include "learner/app/policy_file.h"
#include "learner/app/process.h"
#include "learner/app/study_file.h"
#include "learner/app/task_survey.h"
#include "learner/report/atomic_file.h"
#include "learner/report/csv.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Room for the two million numbers a trace may have.
constexpr std::size_t kAnswerBytesMax = 64'000'000;
/// Wall time that an evaluation may take, as a multiple of the task's limit of processor time, and
/// on top of it: one that burns none is blocked.
constexpr double kBlockedFactor = 10;
constexpr double kBlockedExtraS = 10;

struct Outcome {
  double reward = 0;
  std::string status;
  std::string complaint = {};
  std::vector<std::string> columns = {};
  std::vector<double> numbers = {};  ///< row by row; NaN for those that are not finite
};

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

void check_dims(const Policy& policy, const TaskFacts& task, const fs::path& file) {
  const Gmm finest = policy.tree.finest();
  if (finest.input_dim() == task.input_dim && finest.output_dim() == task.output_dim) return;
  throw ConfigError(
      "POLICY", file.string(),
      fmt::format("has {} inputs and {} outputs, must have {} inputs and {} outputs "
                  "for this task",
                  finest.input_dim(), finest.output_dim(), task.input_dim, task.output_dim));
}

bool is_status(const std::string& word) {
  for (int i = 0; i < kNumRolloutStatuses; ++i) {
    if (name(static_cast<RolloutStatus>(i)) == word) return true;
  }
  return false;
}

/// The answer of a user's program: checked like anything from outside.
std::optional<Outcome> read_answer(const json& said, const TaskFacts& task, bool trace) {
  try {
    const json& evaluation = said.at("evaluation");
    Outcome outcome;
    outcome.reward = evaluation.at("reward").get<double>();
    outcome.status = evaluation.at("status").get<std::string>();
    outcome.complaint = said.at("complaint").get<std::string>();
    const bool ok = outcome.status == name(RolloutStatus::kOk);
    const bool in_range = outcome.reward >= task.reward_min && outcome.reward <= task.reward_max;
    if (!is_status(outcome.status) || (ok ? !in_range : outcome.reward != 0)) return std::nullopt;
    if (!trace) return outcome;
    outcome.columns = said.at("trace").at("columns").get<std::vector<std::string>>();
    for (const json& number : said.at("trace").at("numbers")) {
      outcome.numbers.push_back(number.is_null() ? NAN : number.get<double>());
    }
    const std::size_t width = outcome.columns.size();
    if (width == 0 ? !outcome.numbers.empty() : outcome.numbers.size() % width != 0) {
      return std::nullopt;
    }
    return outcome;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

Outcome ask(const EvaluateOptions& options, const std::string& task_content, const TaskFacts& task,
            const std::string& policy_text) {
  const bool trace = !options.trace_file.empty();
  const json request{{"task", json::parse(task_content)},
                     {"policy", policy_text},
                     {"seed", options.seed},
                     {"trace", trace}};
  const std::chrono::seconds limit(static_cast<std::int64_t>(
      std::min(1e9, kBlockedFactor * task.time_limit_s) + kBlockedExtraS));
  const Result<ProgramOutput> answer =
      run_program(options.worker_program, {"--evaluate"}, request.dump(), limit, kAnswerBytesMax);
  if (!answer) throw std::runtime_error("cannot evaluate: " + answer.error().message);
  // How the evaluation ended the process says more than what it has printed before.
  const int signal = answer->exit_status - kEndedBySignal;
  if (signal == SIGXCPU || signal == SIGKILL) {
    return {.status = std::string(name(RolloutStatus::kTimedOut)),
            .complaint = fmt::format("it took more than the task's limit of {} s of processor time",
                                     task.time_limit_s)};
  }
  if (signal > 0) {
    return {.status = std::string(name(RolloutStatus::kCrashed)),
            .complaint = fmt::format("it was ended by signal {}", signal)};
  }
  const json said = json::parse(answer->output, nullptr, /*allow_exceptions=*/false);
  if (said.is_object() && said.contains("error") && said["error"].is_object()) {
    const json& error = said["error"];
    throw ConfigError(error.value("key", "request"), error.value("value", ""),
                      error.value("rule", "is refused"));
  }
  std::optional<Outcome> outcome = read_answer(said, task, trace);
  if (answer->exit_status != 0 || !outcome) {
    throw std::runtime_error(
        fmt::format("{} --evaluate ended with status {} and said nothing that can be read",
                    options.worker_program.string(), answer->exit_status));
  }
  return *std::move(outcome);
}

void write_trace(const fs::path& path, const Outcome& outcome) {
  AtomicFile file(path);
  const std::size_t width = outcome.columns.size();
  for (std::size_t i = 0; i < width; ++i) {
    file.append(csv_field(outcome.columns[i]));
    file.append(i + 1 < width ? "," : "\n");
  }
  for (std::size_t i = 0; i < outcome.numbers.size(); ++i) {
    if (std::isfinite(outcome.numbers[i])) file.append(fmt::format("{}", outcome.numbers[i]));
    file.append((i + 1) % width != 0 ? "," : "\n");
  }
  file.commit();
}

}  // namespace

void evaluate_policy(const EvaluateOptions& options) {
  check_paths(options);
  const PolicyFile file = read_policy_file("POLICY", options.policy_file);
  const LoadedStudy loaded = load_study(options.study_file, options.overrides);
  const std::size_t chosen = choose_condition(loaded.study, options.condition);
  const Condition& condition = loaded.study.conditions[chosen];
  const TaskFacts task = [&] {
    try {
      return describe_task(condition.task_content, options.worker_program);
    } catch (const ConfigError& error) {
      throw condition_error(loaded, chosen, error);
    }
  }();
  check_dims(file.policy, task, options.policy_file);

  const Outcome outcome = ask(options, condition.task_content, task, file.text);
  if (!outcome.complaint.empty()) spdlog::warn("{}", outcome.complaint);
  if (!options.trace_file.empty()) {
    if (outcome.columns.empty() && outcome.status == name(RolloutStatus::kOk)) {
      throw ConfigError("--trace", options.trace_file.string(), "this task records no trace");
    }
    if (!outcome.columns.empty()) write_trace(options.trace_file, outcome);
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
  if (std::fflush(stdout) != 0) throw std::runtime_error("cannot write to standard output");
}

}  // namespace treeroll
