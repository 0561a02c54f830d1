#include "tests/simulation/reference.h"

#include "learner/core/learner_core.h"
#include "tests/simulation/planted_fault.h"

namespace treeroll::simulation {

std::vector<RunRecord> faultless_records(const Study& study, const VirtualTask& task,
                                         const std::vector<int>& ends) {
  const WithoutFault without_fault;
  std::vector<RunRecord> records;
  for (int index = 0; index < study.num_runs(); ++index) {
    learner::Run run(study, index);
    int num_applied = 0;
    const auto stop_if_due = [&] {
      if (!ends.empty() && num_applied == ends[static_cast<std::size_t>(index)]) run.stop();
    };
    stop_if_due();
    while (!run.done()) {
      for (const explore::Draw& draw : run.take_draws()) {
        const protocol::RolloutKey key{index, draw.rollout};
        const std::vector<double> theta(draw.theta.data(), draw.theta.data() + draw.theta.size());
        num_applied += run.accept(draw.rollout, {task.reward(key, theta), task.status(key)}, 0);
        stop_if_due();
      }
    }
    records.push_back(run.record());
  }
  return records;
}

std::vector<RunRecord> folded_records(const Study& study,
                                      const std::vector<JournalRecord>& journal) {
  const WithoutFault without_fault;
  learner::LearnerCore core(study, {.learner_id = 1, .batch_bytes_max = 1400, .known_tasks = {}});
  learner::Effects effects;
  core.step(TimePoint{}, learner::Started{}, effects);
  for (const JournalRecord& record : journal) {
    if (const auto* result = std::get_if<AcceptedResult>(&record)) {
      core.step(TimePoint{}, learner::ResultRecovered{*result}, effects);
    } else if (const auto* time = std::get_if<LearningTime>(&record)) {
      core.step(TimePoint{}, learner::TimeRecovered{*time}, effects);
    }
    effects = {};
  }
  return core.run_records();
}

bool same(const RunRecord& a, const RunRecord& b) {
  if (a.rollouts.size() != b.rollouts.size()) return false;
  for (std::size_t i = 0; i < a.rollouts.size(); ++i) {
    const RolloutRecord& x = a.rollouts[i];
    const RolloutRecord& y = b.rollouts[i];
    if (x.reward != y.reward || x.layer != y.layer || x.status != y.status) return false;
  }
  return a.final_reward == b.final_reward && a.switches == b.switches &&
         a.best_rollout == b.best_rollout && a.best_reward == b.best_reward &&
         a.best_policy == b.best_policy;
}

}  // namespace treeroll::simulation
