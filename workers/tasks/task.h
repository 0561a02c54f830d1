#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/base/outcome.h"
#include "common/policy/controller.h"
#include "common/task_facts/task_description.h"

namespace treeroll {

class SettingsReader;
struct SettingsReference;
class Trace;

/// A task: plant + controller -> reward. One instance lives in each evaluator process and is asked
/// again and again, from one thread. A task of one's own is one class and one registration:
///
///   class ReachTask : public treeroll::Task {
///    public:
///     explicit ReachTask(treeroll::SettingsReader& settings)
///         : goal_m_(settings.number("goal_m", treeroll::kPositive, 1)) {}
///     treeroll::TaskDescription description() const override {
///       return {.input_dim = 1, .output_dim = 1, .reward_max = 1, .time_limit_s = 1};
///     }
///     treeroll::Outcome evaluate(treeroll::Controller& controller, std::uint64_t) override {
///       controller.start();
///       const double miss_m = controller.act(2.) - goal_m_;
///       return treeroll::Outcome::ok(treeroll::elementary::exp(-miss_m * miss_m));
///     }
///    private:
///     double goal_m_;
///   };
///
///   treeroll::add_task<ReachTask>(registry, "reach");
///
/// A study then names it: [task] name = "reach", and goal_m among its settings.
class Task {
 public:
  virtual ~Task() = default;
  virtual TaskDescription description() const = 0;
  /// A simulation that goes wrong is an answer with a status and a reason. A trial that says
  /// nothing of the policy (an operator rejects it) is Outcome::discarded(): it costs no budget,
  /// and the same policy is tried again with another seed, a bounded number of times
  /// (study.discards_max).
  /// @param controller  of a policy with the dimensions of the description
  /// @param seed        for tasks that are not deterministic
  virtual Outcome evaluate(Controller& controller, std::uint64_t seed) = 0;
  /// One of several evaluations.
  struct Evaluation {
    Controller& controller;
    std::uint64_t seed = 0;
  };
  /// evaluate() for each, to the bit: whatever their number, and whoever is beside one. A task that
  /// simulates several side by side overrides this and the next.
  virtual std::vector<Outcome> evaluate_all(std::span<const Evaluation> evaluations) {
    std::vector<Outcome> outcomes;
    for (const Evaluation& one : evaluations) {
      outcomes.push_back(evaluate(one.controller, one.seed));
    }
    return outcomes;
  }
  /// Whether evaluate_all() is more than one after the other. If it is not, evaluators do that
  /// themselves, and nothing that one roll-out leaves behind reaches the next.
  virtual bool side_by_side() const { return false; }
  /// The same evaluation, to the bit, that also records what happens on the way
  /// (workers/tasks/trace.h), and what the reward is made of, for treeroll-evaluate, the report and
  /// the page. A task that does not override it records nothing. Learning never calls it.
  virtual Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& /*trace*/) {
    return evaluate(controller, seed);
  }
};

/// Makes a task from its settings, read strictly: throws ConfigError on bad ones. Keys it has not
/// asked for are refused by the registry.
using TaskFactory = std::function<std::unique_ptr<Task>(SettingsReader& settings)>;

/// The tasks a worker executable knows, by name.
class TaskRegistry {
 public:
  /// Precondition: the name is new and not empty.
  /// @param start  TOML, [policy] and [exploration] that a new study of the task begins with
  ///               (treeroll-learner --new); empty: what suits its numbers of inputs and outputs
  void add(std::string name, TaskFactory factory, std::string start = "");

  /// Throws ConfigError for an unknown name (with the known ones) and for bad settings; their keys
  /// begin with "task.".
  /// @param settings  a JSON object
  /// @param resolved  receives the settings with their defaults: making the task from these again
  ///                  gives the same task
  std::unique_ptr<Task> make(const std::string& name, const nlohmann::json& settings,
                             nlohmann::json& resolved) const;

  /// What the last bits of its tasks depend on beside processor, C library and elementary
  /// functions: a word, and a function that finds out what it is here. Part of the name of a
  /// worker's numeric class.
  void depends_on(const std::string& word, std::function<std::string()> is_here);
  /// " ode 1f2e3d4c", in the order of depends_on(); empty if they depend on nothing else.
  std::string numeric_suffix() const;

  std::vector<std::string> names() const;
  /// What there is to set of a task. Throws ConfigError for an unknown name.
  SettingsReference settings(const std::string& name) const;
  /// As add() was given it. Throws as settings().
  const std::string& start(const std::string& name) const;

 private:
  struct Known {
    TaskFactory make;
    std::string start;
  };
  const Known& find(const std::string& name) const;

  std::map<std::string, Known> tasks_;
  std::vector<std::pair<std::string, std::function<std::string()>>> dependences_;
};

/// Registers a class whose constructor takes a SettingsReader&.
template <class TaskType>
void add_task(TaskRegistry& registry, const std::string& name) {
  registry.add(name, [](SettingsReader& settings) -> std::unique_ptr<Task> {
    return std::make_unique<TaskType>(settings);
  });
}

/// Registers hold, spiral, swing_up, synthetic, track and trajectory.
void add_standard_tasks(TaskRegistry& registry);

}  // namespace treeroll
