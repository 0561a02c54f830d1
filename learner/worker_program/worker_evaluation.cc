#include "learner/worker_program/worker_evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "common/base/check.h"
#include "common/base/cut_text.h"
#include "common/base/for_log.h"
#include "learner/worker_program/process.h"
#include "learner/worker_program/program_answer.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// Room for the two million numbers a trace may have.
constexpr std::size_t kAnswerBytesMax = 64'000'000;
/// Wall time that an evaluation may take, as a multiple of the task's limit of processor time, and
/// on top of it: one that burns none is blocked.
constexpr double kBlockedFactor = 10;
constexpr double kBlockedExtraS = 10;

bool are_among(const std::vector<std::string>& names, const std::vector<std::string>& columns) {
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return std::find(columns.begin(), columns.end(), name) != columns.end();
  });
}

double number_or_nan(const json& number) {
  return number.is_null() ? std::numeric_limits<double>::quiet_NaN() : number.get<double>();
}

/// Throws json::exception for what is of another type.
std::optional<RolloutTrace> read_trace(const json& said) {
  RolloutTrace trace;
  trace.columns = said.at("columns").get<std::vector<std::string>>();
  for (const json& number : said.at("numbers")) trace.numbers.push_back(number_or_nan(number));
  const std::size_t width = trace.columns.size();
  if (width == 0 ? !trace.numbers.empty() : trace.numbers.size() % width != 0) return std::nullopt;
  // Executables built against an earlier version say no more than this.
  const auto names = [&](const char* key) {
    return said.contains(key) ? said[key].get<std::vector<std::string>>()
                              : std::vector<std::string>{};
  };
  trace.policy_inputs = names("policy_inputs");
  trace.policy_outputs = names("policy_outputs");
  if (!are_among(trace.policy_inputs, trace.columns) ||
      !are_among(trace.policy_outputs, trace.columns)) {
    return std::nullopt;
  }
  if (!said.contains("poses")) return trace;
  for (const json& pose : said["poses"]) {
    trace.poses.emplace_back();
    for (const json& line : pose) {
      trace.poses.back().emplace_back();
      for (const json& number : line) trace.poses.back().back().push_back(number_or_nan(number));
      if (trace.poses.back().back().size() % 2 != 0) return std::nullopt;
    }
  }
  if (!trace.poses.empty() && trace.poses.size() != trace.num_rows()) return std::nullopt;
  return trace;
}

/// As workers/tasks/trace.h has them.
constexpr std::size_t kTermsMax = 64;
constexpr std::size_t kTermNameBytesMax = 64;

/// The answer of a user's program: checked like anything from outside.
std::optional<PolicyEvaluation> read_answer(const json& said, const TaskDescription& task,
                                            bool trace) {
  try {
    const json& evaluation = said.at("evaluation");
    const auto reward = evaluation.at("reward").get<double>();
    const auto status = rollout_status(evaluation.at("status").get<std::string>());
    if (!status) return std::nullopt;
    if (*status == RolloutStatus::kOk ? !task.is_in_range(reward) : reward != 0) {
      return std::nullopt;
    }
    // Executables built against an earlier version give no reason.
    const std::string reason = evaluation.value("reason", "");
    PolicyEvaluation done{.outcome = {reward, *status, cut_text(reason, kOutcomeReasonBytesMax)}};
    if (evaluation.contains("duration_s")) {
      const auto duration_s = evaluation["duration_s"].get<double>();
      if (std::isfinite(duration_s) && duration_s >= 0) done.duration_s = duration_s;
    }
    if (evaluation.contains("terms")) {
      if (evaluation["terms"].size() > kTermsMax) return std::nullopt;
      for (const auto& [term, number] : evaluation["terms"].items()) {
        done.terms[for_log(cut_text(term, kTermNameBytesMax))] = number_or_nan(number);
      }
    }
    if (!trace) return done;
    std::optional<RolloutTrace> read = read_trace(said.at("trace"));
    if (!read) return std::nullopt;
    done.trace = *std::move(read);
    return done;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

}  // namespace

PolicyEvaluation evaluate_with(const WorkerProgram& worker_program, const TaskDescription& task,
                               const EvaluationRequest& request) {
  CHECK(task.repeatable || request.is_asked_for, "a robot would move, unasked");
  const json asked{{"task", json::parse(request.task_content)},
                   {"policy", request.policy_text},
                   {"seed", request.seed},
                   {"trace", request.trace}};
  // A user's program is started and describes its task first.
  const std::chrono::seconds start =
      worker_program.evaluator.empty() ? std::chrono::seconds(0) : kDescriptionLimit;
  const std::chrono::seconds limit =
      start + std::chrono::seconds(static_cast<std::int64_t>(
                  std::min(1e9, kBlockedFactor * task.time_limit_s) + kBlockedExtraS));
  const Result<ProgramOutput> answer =
      run_program(worker_program.path, worker_program.arguments({"--evaluate"}), asked.dump(),
                  limit, kAnswerBytesMax);
  if (!answer) throw std::runtime_error("cannot evaluate: " + answer.error().message);
  // How the evaluation ended the process says more than what it has printed before.
  const int signal = answer->exit_status - kEndedBySignal;
  // SIGKILL is the system's word on the limit where SIGXCPU was not heeded. Else it is another's.
  const bool is_past_limit = signal == SIGKILL && answer->processor_s >= task.time_limit_s;
  if (signal == SIGXCPU || is_past_limit) {
    return {.outcome = Outcome::failed(
                RolloutStatus::kTimedOut,
                fmt::format("took more than the task's limit of {} s of processor time",
                            task.time_limit_s))};
  }
  if (signal > 0) {
    return {.outcome = Outcome::failed(
                RolloutStatus::kCrashed,
                fmt::format("was ended by signal {}{}", signal,
                            signal == SIGKILL ? ", for want of memory most likely" : ""))};
  }
  const std::string unusable =
      fmt::format("{} --evaluate ended with status {} and said nothing that can be read",
                  worker_program.path.string(), answer->exit_status);
  const json said = read_program_answer(answer->output, "request", unusable);
  std::optional<PolicyEvaluation> outcome = read_answer(said, task, request.trace);
  if (answer->exit_status != 0 || !outcome) throw std::runtime_error(unusable);
  return *std::move(outcome);
}

}  // namespace treeroll
