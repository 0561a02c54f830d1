#include "workers/app/evaluate_policy.h"

#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/base/json_text.h"
#include "common/policy/kinds/standard_policies.h"
#include "common/settings/settings_reader.h"
#include "workers/app/checked_evaluation.h"
#include "workers/app/evaluated_task.h"
#include "workers/app/json_answer.h"
#include "workers/app/json_request.h"
#include "workers/app/process_limits.h"
#include "workers/tasks/trace.h"
#include "workers/user_program/user_program.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;

/// A task and a policy of 1 MiB each, and what JSON adds to a text within a text.
constexpr std::size_t kRequestBytesMax = std::size_t{4} << 20U;

struct Request {
  std::string task;  ///< content of a task definition
  std::string policy;
  std::uint64_t seed = 0;
  bool trace = false;
};

Request read_request() {
  Result<json> parsed =
      parse_json(read_standard_input("request", kRequestBytesMax), kRequestNestingMax);
  if (!parsed) throw ConfigError("request", "", parsed.error().message);
  json& value = *parsed;
  if (!value.is_object() || !value.contains("task")) {
    throw ConfigError("request", "",
                      R"(must be a JSON object {"task": {...}, "policy": ..., ...})");
  }
  Request request;
  request.task = value["task"].dump(-1, ' ', false, json::error_handler_t::replace);
  value.erase("task");
  json resolved;
  SettingsReader reader(value, "request", resolved);
  request.policy = reader.string("policy");
  request.seed =
      static_cast<std::uint64_t>(reader.integer("seed", std::numeric_limits<std::int64_t>::min(),
                                                std::numeric_limits<std::int64_t>::max(), 0));
  request.trace = reader.boolean("trace", false);
  reader.finish();
  return request;
}

PolicyPtr read_policy(const std::string& text, const TaskDescription& task) {
  const Result<PolicyPtr> read = standard_policies().from_json(text);
  if (!read) throw ConfigError("policy", "", read.error().message);
  const Policy& policy = **read;
  if (policy.input_dim() != task.input_dim || policy.output_dim() != task.output_dim) {
    throw ConfigError(
        "policy", "",
        fmt::format("has {} inputs and {} outputs, must have {} inputs and {} "
                    "outputs for this task",
                    policy.input_dim(), policy.output_dim(), task.input_dim, task.output_dim));
  }
  return *read;
}

json to_json(const Trace& trace) {
  json poses = json::array();
  for (const Pose& pose : trace.poses()) {
    json lines = json::array();
    for (const auto& line : pose) {
      json numbers = json::array();
      for (const PosePoint& point : line) {
        numbers.push_back(point.x_m);
        numbers.push_back(point.y_m);
      }
      lines.push_back(std::move(numbers));
    }
    poses.push_back(std::move(lines));
  }
  return {{"columns", trace.columns()},
          {"numbers", trace.numbers()},
          {"policy_inputs", trace.policy_inputs()},
          {"policy_outputs", trace.policy_outputs()},
          {"poses", std::move(poses)}};
}

/// A signal that ends the user's program ends this one, which tells the caller.
Outcome evaluate(EvaluatedTask& task, const Trial& trial, Trace& trace) {
  try {
    return task.evaluate(trial, &trace);
  } catch (const ProgramEnded& ended) {
    if (!ended.end.exited) end_likewise(false, ended.end.code);
    return Outcome::failed(RolloutStatus::kCrashed, bounded(ended.what, kOutcomeReasonBytesMax));
  }
}

}  // namespace

int evaluate_policy(const TaskSourceMaker& start) {
  const JsonAnswer answer;
  try {
    const std::unique_ptr<TaskSource> tasks = start();
    const Request request = read_request();
    json resolved;
    const std::unique_ptr<EvaluatedTask> task = tasks->make(request.task, resolved);
    const TaskDescription& description = task->description();
    const PolicyPtr policy = read_policy(request.policy, description);
    turn_off_core_dumps();
    tasks->limit_cpu_time(description.time_limit_s);
    Trace trace(request.trace ? Trace::Kept::kAll : Trace::Kept::kTerms);
    const auto start = std::chrono::steady_clock::now();
    const Outcome outcome = evaluate(*task, {.policy = policy, .seed = request.seed}, trace);
    const std::chrono::duration<double> duration_s = std::chrono::steady_clock::now() - start;
    if (!trace.is_complete()) {
      throw ConfigError("trace", "",
                        fmt::format("the roll-out has more than {} numbers to record; take longer "
                                    "steps or a shorter time",
                                    Trace::kNumbersMax));
    }
    json said{{"description", treeroll::to_json(description)},
              {"evaluation",
               {{"reward", outcome.reward()},
                {"status", name(outcome.status())},
                {"reason", outcome.reason()},
                {"duration_s", duration_s.count()}}}};
    if (!trace.terms().empty()) said["evaluation"]["terms"] = trace.terms();
    if (request.trace) said["trace"] = to_json(trace);
    return answer.give(said);
  } catch (const ConfigError& error) {
    return answer.refuse(error);
  } catch (const ProgramEnded& ended) {
    return answer.refuse(ConfigError("--evaluator", "", "must take a task: " + ended.what));
  }
}

}  // namespace treeroll::worker
