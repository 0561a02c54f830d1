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
  Tasks() { add_standard_tasks(registry_); }

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
  TaskRegistry registry_;
  std::map<std::string, std::unique_ptr<Task>> tasks_;
};

RunRecord learn_run(const Study& study, int index, Tasks& tasks) {
  learner::Run run(study, index);
  Task& task = tasks.get(study.conditions[run.condition()].task_content);
  std::deque<explore::Draw> draws;
  while (!run.done()) {
    for (explore::Draw& more : run.take_draws()) draws.push_back(std::move(more));
    CHECK(!draws.empty(), "a run that is not done wants nothing");
    const explore::Draw next = std::move(draws.front());
    draws.pop_front();
    const std::int64_t seed =
        learner::task_seed(study, run.repetition(), next.rollout, run.num_discards(next.rollout));
    const std::unique_ptr<Controller> controller =
        run.exploration().policy(next.layer).with(next.theta)->controller();
    const Outcome outcome = task.evaluate(*controller, static_cast<std::uint64_t>(seed));
    run.accept(next.rollout, outcome, 0);
  }
  return run.record();
}

}  // namespace

std::vector<RunRecord> run_study(const std::filesystem::path& file,
                                 const std::vector<std::string>& overrides) {
  const Study study = load_study(file, overrides).study;
  Tasks tasks;
  std::vector<RunRecord> records;
  for (int run = 0; run < study.num_runs(); ++run) records.push_back(learn_run(study, run, tasks));
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
