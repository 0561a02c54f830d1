#include "learner/app/check_study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/base/config_error.h"
#include "common/program/processor_share.h"
#include "common/program/program.h"
#include "common/program/standard_output.h"
#include "common/protocol/limits.h"
#include "learner/results/state_directory.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/task_survey.h"
#include "learner/worker_program/worker_evaluation.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// What a condition comes to.
struct Forecast {
  std::vector<int> layers;  ///< that are explored
  std::vector<int> theta_dims;
  const DescribedTask* task = nullptr;  ///< null: no worker program here knows it
  /// The start policy; nothing without the task, or if it is not repeatable.
  std::optional<PolicyEvaluation> started;
};

/// Conditions that begin alike are evaluated once.
class StartEvaluations {
 public:
  explicit StartEvaluations(const WorkerProgram& worker_program)
      : worker_program_(worker_program) {}

  const PolicyEvaluation& of(const Condition& condition, const TaskDescription& task) {
    const std::string policy = to_json(*condition.start);
    const auto [found, is_new] = known_.try_emplace({condition.task_content, policy});
    if (is_new) {
      found->second = evaluate_with(
          worker_program_, task, {.task_content = condition.task_content, .policy_text = policy});
    }
    return found->second;
  }

 private:
  const WorkerProgram& worker_program_;
  std::map<std::pair<std::string, std::string>, PolicyEvaluation> known_;
};

/// Every setting of a condition that neither the study nor the command line gives, by dotted key.
void add_defaults(const json& table, const std::string& path, const SettingOrigins& origins,
                  std::map<std::string, json>& defaults) {
  for (const auto& [key, value] : table.items()) {
    const std::string full = path + "." + key;
    if (full == "task.described") continue;
    if (value.is_object()) {
      add_defaults(value, full, origins, defaults);
    } else if (!origins.contains(full)) {
      defaults[full] = value;
    }
  }
}

/// Those of all conditions: "key = value", and in which conditions unless in all.
std::vector<std::string> defaults_of(const LoadedStudy& loaded) {
  std::map<std::string, std::vector<std::string>> where;
  for (std::size_t c = 0; c < loaded.study.conditions.size(); ++c) {
    std::map<std::string, json> defaults;
    json settings = *loaded.resolved.conditions[c];
    settings["study"].update(*loaded.resolved.study);
    for (const char* table : {"study", "task", "policy", "exploration"}) {
      add_defaults(settings.at(table), table, loaded.origins[c], defaults);
    }
    for (const auto& [key, value] : defaults) {
      where[fmt::format("{} = {}", key, value.dump())].push_back(loaded.study.conditions[c].name);
    }
  }
  std::vector<std::string> lines;
  for (const auto& [setting, conditions] : where) {
    const bool is_everywhere = conditions.size() == loaded.study.conditions.size();
    lines.push_back(is_everywhere ? setting
                                  : fmt::format("{} ({})", setting, fmt::join(conditions, ", ")));
  }
  return lines;
}

struct StudyForecast {
  std::vector<Forecast> conditions;
  std::int64_t rollouts = 0;
  std::int64_t outside = 0;  ///< evaluations of start and final policies
  int evaluators = 0;
  std::optional<double> duration_s;  ///< nothing where a start says nothing of it
};

StudyForecast forecast(const LoadedStudy& loaded, const std::map<std::string, DescribedTask>& tasks,
                       const LearnerOptions& options) {
  const Study& study = loaded.study;
  StartEvaluations evaluations(options.worker_program);
  StudyForecast whole;
  whole.evaluators = options.local_workers > 0
                         ? options.local_workers
                         : std::min(num_usable_processors(), protocol::kEvaluatorsPerWorkerMax);
  double work_s = 0;
  std::int64_t at_once = 0;
  bool is_known = true;
  for (const Condition& condition : study.conditions) {
    Forecast& one = whole.conditions.emplace_back();
    for (int l = condition.exploration.first_layer; l <= condition.exploration.last_layer; ++l) {
      one.layers.push_back(l);
      one.theta_dims.push_back(condition.start->at_layer(l)->theta_dim());
    }
    const std::int64_t rollouts =
        std::int64_t{condition.exploration.num_rollouts} * study.repetitions;
    whole.rollouts += rollouts;
    whole.outside += std::int64_t{1 + study.final_evaluations} * study.repetitions;
    at_once += std::int64_t{condition.exploration.in_flight} * study.repetitions;
    const auto task = tasks.find(condition.task_content);
    if (task != tasks.end()) {
      one.task = &task->second;
      // What may not be started twice may be a robot: asking about a study must not move it.
      if (task->second.description.repeatable) {
        one.started = evaluations.of(condition, task->second.description);
      }
    }
    is_known = is_known && one.started && one.started->duration_s;
    if (is_known) work_s += static_cast<double>(rollouts) * *one.started->duration_s;
  }
  const std::int64_t busy = std::min<std::int64_t>(whole.evaluators, at_once);
  if (is_known) whole.duration_s = work_s / static_cast<double>(busy);
  return whole;
}

std::string counted(std::int64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string duration_text(double duration_s) {
  if (duration_s < 120) return fmt::format("{:.2g} s", std::max(duration_s, .01));
  if (duration_s < 7200) return fmt::format("{:.0f} min", duration_s / 60);
  return fmt::format("{:.1f} h", duration_s / 3600);
}

void print_condition(const Condition& condition, const Forecast& one, const std::string& rule) {
  fmt::print("condition  {}: {} of each run, {} in flight, rule \"{}\"\n", condition.name,
             counted(condition.exploration.num_rollouts, "roll-out"),
             condition.exploration.in_flight, rule);
  std::vector<std::string> thetas;
  for (std::size_t i = 0; i < one.layers.size(); ++i) {
    thetas.push_back(fmt::format("{} in layer {}", one.theta_dims[i], one.layers[i]));
  }
  fmt::print("  policy   {}, numbers of theta: {}\n", condition.start->kind(),
             fmt::join(thetas, ", "));
  const std::string name = json::parse(condition.task_content)["name"].get<std::string>();
  if (one.task == nullptr) {
    fmt::print("  task     {}: no worker program here knows it (--worker-program)\n", name);
    return;
  }
  const TaskDescription& task = one.task->description;
  fmt::print("  task     {}: {}, {}, rewards {:g} to {:g}, at most {:g} s, {}\n", name,
             counted(task.input_dim, "input"), counted(task.output_dim, "output"), task.reward_min,
             task.reward_max, task.time_limit_s,
             task.deterministic ? "deterministic" : "not deterministic");
  if (!task.signals.empty()) {
    fmt::print("  signals  {} -> {}\n", fmt::join(task.signals.inputs, ", "),
               fmt::join(task.signals.outputs, ", "));
  }
  if (!one.started) {
    fmt::print("  start    not tried: no roll-out of this task is started without need\n");
    return;
  }
  const Outcome& outcome = one.started->outcome;
  if (outcome.is_ok()) {
    fmt::print("  start    reward {:.3g}", outcome.reward());
  } else {
    fmt::print("  start    {}: {}", treeroll::name(outcome.status()), outcome.reason());
  }
  if (one.started->duration_s) fmt::print(", in {:.3g} ms", *one.started->duration_s * 1e3);
  fmt::print("\n");
}

/// What the learner would say of it.
std::string trouble_with(const std::filesystem::path& directory) {
  try {
    check_state_directory(directory);
    return "";
  } catch (const ConfigError& error) {
    return ": " + error.rule();
  }
}

void print_text(const LoadedStudy& loaded, const StudyForecast& whole,
                const LearnerOptions& options) {
  const Study& study = loaded.study;
  fmt::print("study      {}: {} x {} = {}\n", study.name,
             counted(static_cast<std::int64_t>(study.conditions.size()), "condition"),
             counted(study.repetitions, "repetition"), counted(study.num_runs(), "run"));
  fmt::print("roll-outs  {}, and {} of start and final policies\n", whole.rollouts,
             counted(whole.outside, "evaluation"));
  for (std::size_t c = 0; c < study.conditions.size(); ++c) {
    print_condition(study.conditions[c], whole.conditions[c],
                    loaded.resolved.conditions[c]->at("exploration").at("rule"));
  }
  if (whole.duration_s) {
    fmt::print("time       about {} with {}, if all roll-outs take as long as that of the start\n",
               duration_text(*whole.duration_s), counted(whole.evaluators, "evaluator"));
  }
  if (study.stop_after) {
    fmt::print("           ended after {} of learning at the latest\n",
               duration_text(std::chrono::duration<double>(*study.stop_after).count()));
  }
  const auto directory = results_directory(options, study.name);
  fmt::print("results    {}{}\n", directory.string(), trouble_with(directory));
  const std::vector<std::string> defaults = defaults_of(loaded);
  for (std::size_t i = 0; i < defaults.size(); ++i) {
    fmt::print("{}  {}\n", i == 0 ? "by default" : "          ", defaults[i]);
  }
}

void print_json(const LoadedStudy& loaded, const StudyForecast& whole) {
  json conditions = json::array();
  for (std::size_t c = 0; c < loaded.study.conditions.size(); ++c) {
    const Condition& condition = loaded.study.conditions[c];
    const Forecast& one = whole.conditions[c];
    json said{{"name", condition.name},
              {"rollouts", condition.exploration.num_rollouts},
              {"policy", condition.start->kind()},
              {"layers", one.layers},
              {"theta", one.theta_dims},
              {"start", nullptr}};
    if (one.started) {
      said["start"] = {{"reward", one.started->outcome.reward()},
                       {"status", name(one.started->outcome.status())},
                       {"reason", one.started->outcome.reason()}};
    }
    conditions.push_back(std::move(said));
  }
  json said{{"study", loaded.study.name},          {"runs", loaded.study.num_runs()},
            {"rollouts", whole.rollouts},          {"evaluations", whole.outside},
            {"evaluators", whole.evaluators},      {"duration_s", nullptr},
            {"conditions", std::move(conditions)}, {"by_default", defaults_of(loaded)}};
  if (whole.duration_s) said["duration_s"] = *whole.duration_s;
  fmt::print("{}\n", said.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace

void check_study(const LearnerOptions& options) {
  LoadedStudy loaded = load_study(options.study_file, options.overrides);
  std::map<std::string, DescribedTask> tasks =
      survey_tasks(loaded, options.worker_program, options.needs_worker_program);
  const StudyForecast whole = forecast(loaded, tasks, options);
  resolve_tasks(loaded, tasks);
  static_cast<void>(loaded.resolved.to_toml(program_version()));  // refused if it is too large
  if (options.json) {
    print_json(loaded, whole);
  } else {
    print_text(loaded, whole, options);
  }
  flush_standard_output();
}

}  // namespace treeroll
