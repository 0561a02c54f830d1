#include "learner/app/evaluate.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/config_error.h"
#include "common/base/csv_field.h"
#include "common/files/atomic_file.h"
#include "common/program/standard_output.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/study/policy_file.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/task_survey.h"
#include "learner/worker_program/worker_evaluation.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

void check_trace_file(const EvaluateOptions& options) {
  if (options.trace_file.empty()) return;
  const fs::path folder = options.trace_file.parent_path();
  if (fs::is_directory(options.trace_file) || !options.trace_file.has_filename() ||
      !fs::is_directory(folder.empty() ? "." : folder)) {
    throw ConfigError("--trace", options.trace_file.string(),
                      "must be a file in a folder there is");
  }
}

/// Null without any.
json bounds_of(const Condition& condition) {
  const json content = condition.start->content();
  return content.value("bounds", json());
}

/// Index of the condition whose task and bounds count.
std::size_t choose_condition(const Study& study, const std::string& name) {
  std::string known;
  const Condition& first = study.conditions.front();
  bool share_a_task = true;
  bool share_bounds = true;
  for (std::size_t c = 0; c < study.conditions.size(); ++c) {
    const Condition& condition = study.conditions[c];
    if (condition.name == name) return c;
    known += (c == 0 ? "" : ", ") + condition.name;
    share_a_task = share_a_task && condition.task_content == first.task_content;
    share_bounds = share_bounds && bounds_of(condition) == bounds_of(first);
  }
  if (!name.empty()) {
    throw ConfigError("--condition", name, "must be a condition of the study: " + known);
  }
  if (!share_a_task || !share_bounds) {
    throw ConfigError("--condition", "",
                      fmt::format("must be given, for the conditions have different {}: {}",
                                  share_a_task ? "policy.bounds" : "tasks", known));
  }
  return 0;
}

void check_signals(const PolicyFile& file, const TaskDescription& task, const fs::path& path) {
  const Policy& policy = *file.policy;
  if (policy.input_dim() != task.input_dim || policy.output_dim() != task.output_dim) {
    throw ConfigError(
        "POLICY", path.string(),
        fmt::format("has {} inputs and {} outputs, must have {} inputs and {} outputs "
                    "for this task",
                    policy.input_dim(), policy.output_dim(), task.input_dim, task.output_dim));
  }
  if (const auto other = difference(file.signals, "those of the task are", task.signals)) {
    throw ConfigError(
        "POLICY", path.string(),
        fmt::format("its {}: must be a policy of this task, or name no signals", *other));
  }
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

/// A policy of a run and the other one that the run has left beside it.
struct Relation {
  std::string what;  ///< empty: it is none of a run
  std::string other_what;
  fs::path other;  ///< empty: there is none
};

Relation relation_of(const fs::path& file) {
  constexpr std::string_view kBest = "best roll-out";
  constexpr std::string_view kFinal = "final mean policy";
  const std::string path = file.string();
  const std::size_t end = path.size() - std::min(path.size(), kFinalPolicyEnding.size());
  if (path.substr(end) == kFinalPolicyEnding) {
    const fs::path other = path.substr(0, end) + ".json";
    return {std::string(kFinal), std::string(kBest), fs::exists(other) ? other : fs::path()};
  }
  fs::path other = file;
  other.replace_extension(kFinalPolicyEnding);
  if (!fs::exists(other)) return {};
  return {std::string(kBest), std::string(kFinal), other};
}

/// What is said of a policy.
struct Worth {
  fs::path policy_file;
  std::string condition;
  std::string task;
  std::vector<Outcome> outcomes;  ///< by seed
  /// What the reward of the first is made of, if the task says so.
  std::map<std::string, double> terms;
};

std::string in_words(const Outcome& outcome) {
  const std::string status(name(outcome.status()));
  return outcome.reason().empty() ? status : status + ": " + outcome.reason();
}

void print(const Worth& worth, bool as_json) {
  const Relation relation = relation_of(worth.policy_file);
  const std::vector<Outcome>& outcomes = worth.outcomes;
  const double reward = mean_reward(outcomes).value_or(0);
  const std::optional<Interval> interval = mean_interval_95(rewards_of(outcomes));
  const auto failed = std::ranges::find_if(outcomes, [](const Outcome& o) { return !o.is_ok(); });
  const auto num_discarded =
      std::ranges::count_if(outcomes, [](const Outcome& o) { return o.is_discarded(); });
  const auto num_failed =
      std::ranges::count_if(outcomes, [](const Outcome& o) { return !o.is_ok(); }) - num_discarded;
  const auto num_valued = static_cast<std::int64_t>(outcomes.size()) - num_discarded;
  const Outcome& shown = failed == outcomes.end() ? outcomes.front() : *failed;
  if (as_json) {
    json said{{"policy", worth.policy_file.string()},
              {"condition", worth.condition},
              {"task", worth.task},
              {"reward", num_valued > 0 ? json(reward) : json(nullptr)},
              {"status", name(shown.status())},
              {"reason", shown.reason()},
              {"evaluations", outcomes.size()},
              {"failed", num_failed},
              {"discarded", num_discarded},
              {"interval_95", nullptr},
              {"policy_is", nullptr},
              {"beside", nullptr}};
    if (interval) said["interval_95"] = {interval->low, interval->high};
    if (!worth.terms.empty()) said["terms"] = worth.terms;
    if (!relation.what.empty()) said["policy_is"] = relation.what;
    if (!relation.other.empty()) said["beside"] = relation.other.string();
    return fmt::print("{}\n", said.dump(-1, ' ', false, json::error_handler_t::replace));
  }
  std::string policy = worth.policy_file.string();
  if (!relation.what.empty()) policy += ", the " + relation.what;
  if (!relation.other.empty()) {
    policy += fmt::format("; the {} is {}", relation.other_what, relation.other.string());
  }
  fmt::print("policy  {}\ntask    {}\nreward  {}", policy, worth.task,
             num_valued > 0 ? fmt::format("{}", reward) : "none: its trials are void");
  if (num_valued > 1) {
    fmt::print(" {}, the mean of {} evaluations", shown_interval(interval), num_valued);
  }
  fmt::print("\nstatus  {}", in_words(shown));
  if (outcomes.size() > 1 && num_failed > 0) {
    fmt::print(" ({} of {} evaluations failed)", num_failed, outcomes.size());
  }
  if (outcomes.size() > 1 && num_discarded > 0) {
    fmt::print(" ({} of {} evaluations were discarded)", num_discarded, outcomes.size());
  }
  fmt::print("\n");
  for (const auto& [term, number] : worth.terms) fmt::print("term    {} {}\n", term, number);
}

/// A policy whose own theta its bounds refuse gives nothing.
void check_acts(const Policy& policy, const fs::path& path) {
  try {
    static_cast<void>(policy.controller());
  } catch (const std::invalid_argument& error) {
    throw ConfigError("POLICY", path.string(), error.what());
  }
}

/// The file's policy with the bounds of the study, as policy.start_file has it: what a robot must
/// never do counts for a policy that is older than them, too.
std::string within_bounds(const PolicyFile& file, const fs::path& path,
                          const Condition& condition) {
  const json bounds = bounds_of(condition);
  if (bounds.is_null()) return file.text;
  json own = json::parse(to_json(*file.policy));
  if (own.contains("bounds")) {
    if (own["bounds"] == bounds) return file.text;
    throw ConfigError("POLICY", path.string(),
                      fmt::format("has other bounds than the study in condition {}: change "
                                  "policy.bounds of one of them",
                                  condition.name));
  }
  own["bounds"] = bounds;
  std::string text = own.dump();
  const Result<PolicyPtr> bounded = learnable_policies().from_json(text);
  if (!bounded) {
    throw ConfigError("POLICY", path.string(),
                      "cannot have the study's policy.bounds: " + bounded.error().message);
  }
  check_acts(**bounded, path);
  spdlog::info("the study's policy.bounds count: {} has none", path.string());
  return text;
}

}  // namespace

void evaluate_policy(const EvaluateOptions& options) {
  check_trace_file(options);
  if (options.seed > std::numeric_limits<std::int64_t>::max() - (options.evaluations - 1)) {
    throw ConfigError("--seed", std::to_string(options.seed),
                      fmt::format("must leave room for {} seeds", options.evaluations));
  }
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
  check_signals(file, task, options.policy_file);
  check_acts(*file.policy, options.policy_file);
  const std::string text = within_bounds(file, options.policy_file, condition);

  std::vector<Outcome> outcomes;
  std::map<std::string, double> terms;
  for (int i = 0; i < options.evaluations; ++i) {
    const PolicyEvaluation done = evaluate_with(options.worker_program, task,
                                                {.task_content = condition.task_content,
                                                 .policy_text = text,
                                                 .seed = options.seed + i,
                                                 .trace = i == 0 && !options.trace_file.empty(),
                                                 .is_asked_for = true});
    outcomes.push_back(done.outcome);
    if (i == 0) terms = done.terms;
    if (i == 0 && !options.trace_file.empty()) {
      if (done.trace.columns.empty() && done.outcome.is_ok()) {
        throw ConfigError("--trace", options.trace_file.string(), "this task records no trace");
      }
      if (!done.trace.columns.empty()) write_trace(options.trace_file, done.trace);
    }
  }
  if (!task.deterministic && options.evaluations == 1) {
    spdlog::warn(
        "the task is not deterministic: one evaluation is luck, --evaluations 20 says more");
  }
  const std::string task_name = json::parse(condition.task_content)["name"].get<std::string>();
  print(Worth{.policy_file = options.policy_file,
              .condition = condition.name,
              .task = task_name,
              .outcomes = std::move(outcomes),
              .terms = std::move(terms)},
        options.json);
  flush_standard_output();
}

}  // namespace treeroll
