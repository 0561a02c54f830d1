#include "workers/app/evaluated_task.h"

#include <new>
#include <nlohmann/json.hpp>
#include <utility>

#include "workers/app/checked_evaluation.h"
#include "workers/app/process_limits.h"
#include "workers/app/task_content.h"
#include "workers/tasks/trace.h"
#include "workers/user_program/user_program.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;

class OwnTask : public EvaluatedTask {
 public:
  explicit OwnTask(std::unique_ptr<Task> task)
      : task_(std::move(task)), description_(task_->description()) {}

  const TaskDescription& description() const override { return description_; }

  Outcome evaluate(const Trial& trial, Trace* trace) override {
    const std::unique_ptr<Controller> controller = trial.policy->controller();
    return evaluate_checked(*task_, description_, *controller, trial.seed, trace);
  }

  bool side_by_side() const override { return task_->side_by_side(); }

  std::optional<std::vector<Outcome>> evaluate_all(std::span<const Trial> trials) override {
    std::vector<std::unique_ptr<Controller>> controllers;
    std::vector<Task::Evaluation> evaluations;
    for (const Trial& trial : trials) {
      controllers.push_back(trial.policy->controller());
      evaluations.push_back({*controllers.back(), trial.seed});
    }
    return evaluate_all_checked(*task_, description_, evaluations);
  }

 private:
  std::unique_ptr<Task> task_;
  TaskDescription description_;
};

class OwnTasks : public TaskSource {
 public:
  explicit OwnTasks(const TaskRegistry& registry) : registry_(registry) {}
  std::unique_ptr<EvaluatedTask> make(const std::string& content, json& resolved) override {
    return std::make_unique<OwnTask>(make_task(registry_, content, resolved));
  }
  void limit_cpu_time(double limit_s) override { worker::limit_cpu_time(limit_s); }

 private:
  const TaskRegistry& registry_;
};

/// The task that a program has described last: it has one at a time.
class ProgramTask : public EvaluatedTask {
 public:
  ProgramTask(UserProgram& program, TaskDescription description)
      : program_(program), description_(std::move(description)) {}

  const TaskDescription& description() const override { return description_; }

  Outcome evaluate(const Trial& trial, Trace* trace) override {
    const EvaluateAnswer answer = program_.evaluate(
        {trial.run, trial.rollout, trial.seed, to_json(*trial.policy, description_.signals)},
        description_, trace != nullptr && trace->keeps_rows() ? trace : nullptr);
    if (trace == nullptr) return answer.outcome;
    for (const auto& [name, number] : answer.terms) trace->set_term(name, number);
    return answer.outcome;
  }

 private:
  UserProgram& program_;
  TaskDescription description_;
};

class ProgramTasks : public TaskSource {
 public:
  explicit ProgramTasks(std::unique_ptr<UserProgram> program) : program_(std::move(program)) {}

  std::unique_ptr<EvaluatedTask> make(const std::string& content, json& resolved) override {
    const TaskDescription description = resolve_task(
        content, resolved, [&](const std::string& name, const json& settings, json& found) {
          const DescribeAnswer answer = program_->describe(name, settings);
          found = answer.settings ? json::parse(*answer.settings) : settings;
          return answer.description;
        });
    return std::make_unique<ProgramTask>(*program_, description);
  }
  void limit_cpu_time(double limit_s) override { program_->process().limit_cpu_time(limit_s); }
  void attend(int descriptor) override { program_->attend(descriptor); }

 private:
  std::unique_ptr<UserProgram> program_;
};

}  // namespace

std::unique_ptr<TaskSource> tasks_of(const TaskRegistry& registry) {
  return std::make_unique<OwnTasks>(registry);
}

std::unique_ptr<TaskSource> tasks_of(std::unique_ptr<UserProgram> program) {
  return std::make_unique<ProgramTasks>(std::move(program));
}

}  // namespace treeroll::worker
