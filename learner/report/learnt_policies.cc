#include "learner/report/learnt_policies.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/base/config_error.h"
#include "common/program/program_command.h"
#include "learner/report/figures/study_plots.h"
#include "learner/report/statistics/sample.h"
#include "learner/worker_program/task_survey.h"
#include "learner/worker_program/worker_evaluation.h"

namespace treeroll::report {
namespace {

/// A picture shows no more of a trace.
constexpr std::size_t kRowsMax = 400;

/// Roll-outs of one worker executable, each made once.
class RolloutMaker {
 public:
  explicit RolloutMaker(WorkerProgram program) : program_(std::move(program)) {}

  /// Nothing for what cannot be made: its cause has gone to standard error, once a task. Nothing
  /// either for what may be a robot.
  std::optional<ShownRollout> make(const std::string& task_content, const std::string& policy) {
    const auto key = std::pair(task_content, policy);
    if (const auto known = made_.find(key); known != made_.end()) return known->second;
    return made_[key] = ask(task_content, policy);
  }
  bool may_not_run(const std::string& task_content) const {
    return not_repeatable_.contains(task_content);
  }
  bool all_deterministic() const { return all_deterministic_; }

 private:
  /// Asked once a task, also about one that cannot be described.
  const std::optional<TaskDescription>& task_of(const std::string& content) {
    const auto [task, is_new] = tasks_.try_emplace(content);
    if (!is_new) return task->second;
    task->second = describe_repeatable(content, program_);
    if (!task->second) {
      not_repeatable_.insert(content);
    } else if (!task->second->deterministic) {
      all_deterministic_ = false;
    }
    return task->second;
  }

  std::optional<ShownRollout> ask(const std::string& task_content, const std::string& policy) {
    try {
      const std::optional<TaskDescription>& task = task_of(task_content);
      if (!task) return std::nullopt;
      PolicyEvaluation said = evaluate_with(
          program_, *task,
          {.task_content = task_content, .policy_text = policy, .seed = 0, .trace = true});
      return ShownRollout{.reward = said.outcome.reward(),
                          .status = std::string(name(said.outcome.status())),
                          .trace = thinned(said.trace, kRowsMax),
                          .terms = std::move(said.terms)};
    } catch (const ConfigError& error) {
      if (error.key() == kEvaluatorOption) throw;
      fmt::print(stderr, "a roll-out cannot be shown: {}\n", error.what());
    } catch (const std::runtime_error& error) {
      fmt::print(stderr, "a roll-out cannot be shown: {}\n", error.what());
    }
    return std::nullopt;
  }

  WorkerProgram program_;
  std::map<std::string, std::optional<TaskDescription>> tasks_;
  std::map<std::pair<std::string, std::string>, std::optional<ShownRollout>> made_;
  std::set<std::string> not_repeatable_;
  bool all_deterministic_ = true;
};

NamedPolicy read_best(const RunRecord& run, const PolicyRegistry& registry,
                      const StudyResults& results) {
  Result<NamedPolicy> read = registry.named_from_json(run.best_policy);
  if (read) return *std::move(read);
  throw std::runtime_error(fmt::format("{}: policy of {}, repetition {}: {}",
                                       results.directory.string(), run.condition, run.repetition,
                                       read.error().message));
}

}  // namespace

std::vector<LearntPolicy> learnt_policies(const LoadedStudy& loaded, const StudyResults& results) {
  const PolicyRegistry registry = learnable_policies();
  std::vector<LearntPolicy> policies;
  for (std::size_t i = 0; i < loaded.study.conditions.size(); ++i) {
    const Condition& condition = loaded.study.conditions[i];
    LearntPolicy policy{.condition = condition.name, .start = condition.start};
    policy.columns = loaded.columns[i];
    double best_reward = 0;
    for (const MeasuredRun& run : runs_of(results, condition.name)) {
      if (run->best_policy.empty()) continue;
      NamedPolicy best = read_best(*run, registry, results);
      policy.solutions.push_back(std::move(best.policy));
      // What only workers have said: a resolved study has it already.
      if (!best.signals.empty()) policy.columns = all_of(best.signals);
      if (policy.best && run->best_reward <= best_reward) continue;
      policy.best = policy.solutions.back();
      best_reward = run->best_reward;
    }
    policies.push_back(std::move(policy));
  }
  return policies;
}

std::vector<std::string> make_rollouts(const LoadedStudy& loaded,
                                       const WorkerProgram& worker_program,
                                       std::vector<LearntPolicy>& policies) {
  if (!can_be_executed(worker_program.path)) {
    fmt::print(stderr, "{}: no worker executable: goals and motion of {} are not drawn\n",
               worker_program.path.string(), loaded.study.name);
    return {"Goals and motion are not drawn: there was no worker executable to ask."};
  }
  RolloutMaker maker(worker_program);
  std::vector<std::string> lacking;
  std::vector<std::string> not_run;
  for (std::size_t i = 0; i < policies.size(); ++i) {
    const Condition& condition = loaded.study.conditions[i];
    LearntPolicy& policy = policies[i];
    policy.start_rollout = maker.make(condition.task_content, to_json(*policy.start));
    if (policy.best) {
      policy.best_rollout = maker.make(condition.task_content, to_json(*policy.best));
    }
    if (maker.may_not_run(condition.task_content)) {
      not_run.push_back(policy.condition);
    } else if (!policy.start_rollout || (policy.best && !policy.best_rollout)) {
      lacking.push_back(policy.condition);
    }
  }
  std::vector<std::string> remarks;
  if (!lacking.empty()) {
    remarks.push_back(
        "Goals and motion are not drawn where the worker executable could not make the "
        "roll-outs: " +
        listed(lacking) + ".");
  }
  if (!not_run.empty()) {
    remarks.push_back(
        "Goals and motion are not drawn of tasks that say repeatable = false: they may be robots, "
        "which would move for a picture. So it is with: " +
        listed(not_run) + ".");
  }
  if (!maker.all_deterministic()) {
    remarks.emplace_back("Tasks that are not deterministic are shown with seed 0.");
  }
  return remarks;
}

std::vector<PolicyTerms> terms_of(const std::vector<LearntPolicy>& policies) {
  std::vector<PolicyTerms> all;
  for (const LearntPolicy& policy : policies) {
    PolicyTerms terms{.condition = policy.condition, .start = {}, .best = {}};
    if (policy.start_rollout) terms.start = policy.start_rollout->terms;
    if (policy.best_rollout) terms.best = policy.best_rollout->terms;
    if (!terms.start.empty() || !terms.best.empty()) all.push_back(std::move(terms));
  }
  return all;
}

std::vector<StartModel> start_models(const LoadedStudy& loaded,
                                     const std::vector<LearntPolicy>& policies) {
  std::vector<StartModel> models;
  std::map<std::string, std::size_t> known;  // by the look of the policy
  for (std::size_t i = 0; i < policies.size(); ++i) {
    const auto [place, is_new] = known.emplace(policies[i].start->sketch().look, models.size());
    if (!is_new) {
      models[place->second].conditions.push_back(policies[i].condition);
      continue;
    }
    StartModel model{.conditions = {policies[i].condition},
                     .policy = policies[i].start,
                     .demonstration = loaded.demonstrations[i],
                     .log_likelihoods = loaded.log_likelihoods[i],
                     .columns = names_of(policies[i])};
    models.push_back(std::move(model));
  }
  return models;
}

}  // namespace treeroll::report
