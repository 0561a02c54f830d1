#include "tests/thesis/run_study.h"

#include <deque>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/base/check.h"
#include "learner/core/run.h"
#include "learner/study/study_file.h"
#include "workers/tasks/task.h"

namespace treeroll {
namespace {

/// The tasks of a study, each made once.
class Tasks {
 public:
  explicit Tasks(const TaskRegistry& registry) : registry_(registry) {}

  Task& get(const std::string& content) {
    std::unique_ptr<Task>& task = tasks_[content];
    if (!task) {
      const nlohmann::json json = nlohmann::json::parse(content);
      nlohmann::json resolved;
      task = registry_.make(json["name"], json["settings"], resolved);
    }
    return *task;
  }

 private:
  const TaskRegistry& registry_;
  std::map<std::string, std::unique_ptr<Task>> tasks_;
};

/// A run and its roll-outs that wait.
class Learning {
 public:
  Learning(const Study& study, int index) : study_(study), run_(study, index) {}

  bool done() const { return run_.done(); }
  RunRecord record() const { return run_.record(); }
  const std::string& task() const { return study_.conditions[run_.condition()].task_content; }

  /// Precondition: not done().
  Task::Evaluation next() {
    for (explore::Draw& more : run_.take_draws()) draws_.push_back(std::move(more));
    CHECK(!draws_.empty(), "a run that is not done wants nothing");
    const explore::Draw& draw = draws_.front();
    controller_ = run_.exploration().policy(draw.layer).with(draw.theta)->controller();
    const std::int64_t seed = learner::task_seed(study_, run_.repetition(), draw.rollout,
                                                 run_.num_discards(draw.rollout));
    return {*controller_, static_cast<std::uint64_t>(seed)};
  }
  /// Of next().
  void accept(const Outcome& outcome) {
    const int rollout = draws_.front().rollout;
    draws_.pop_front();
    run_.accept(rollout, outcome, 0);
  }

 private:
  const Study& study_;
  learner::Run run_;
  std::deque<explore::Draw> draws_;
  std::unique_ptr<Controller> controller_;
};

}  // namespace

std::vector<RunRecord> run_study(const std::filesystem::path& file,
                                 const std::vector<std::string>& overrides) {
  TaskRegistry registry;
  add_standard_tasks(registry);
  return run_study(file, overrides, registry);
}

std::vector<RunRecord> run_study(const std::filesystem::path& file,
                                 const std::vector<std::string>& overrides,
                                 const TaskRegistry& registry) {
  const Study study = load_study(file, overrides).study;
  Tasks tasks(registry);
  std::deque<Learning> all;
  std::map<std::string, std::vector<Learning*>> by_task;
  for (int run = 0; run < study.num_runs(); ++run) {
    Learning& learning = all.emplace_back(study, run);
    by_task[learning.task()].push_back(&learning);
  }
  for (auto& [content, runs] : by_task) {
    Task& task = tasks.get(content);
    while (std::erase_if(runs, [](const Learning* run) { return run->done(); }), !runs.empty()) {
      std::vector<Task::Evaluation> evaluations;
      for (Learning* run : runs) evaluations.push_back(run->next());
      const std::vector<Outcome> outcomes = task.evaluate_all(evaluations);
      for (std::size_t i = 0; i < runs.size(); ++i) runs[i]->accept(outcomes[i]);
    }
  }
  std::vector<RunRecord> records;
  for (const Learning& learning : all) records.push_back(learning.record());
  return records;
}

std::vector<RunRecord> of_condition(const std::vector<RunRecord>& runs, const std::string& name) {
  std::vector<RunRecord> chosen;
  for (const RunRecord& run : runs) {
    if (run.condition == name) chosen.push_back(run);
  }
  CHECK(!chosen.empty(), "no runs of condition " + name);
  return chosen;
}

double mean_best(const std::vector<RunRecord>& runs) {
  double sum = 0;
  for (const RunRecord& run : runs) sum += run.best_reward;
  return sum / static_cast<double>(runs.size());
}

double mean_near(const std::vector<RunRecord>& runs, int n) {
  constexpr int kAveraged = 5;
  double sum = 0;
  for (const RunRecord& run : runs) {
    for (int i = n - kAveraged; i < n; ++i) sum += run.rollouts.at(i).reward / kAveraged;
  }
  return sum / static_cast<double>(runs.size());
}

}  // namespace treeroll
