#include "tests/simulation/reference.h"

#include <map>
#include <utility>

#include "learner/core/learner_core.h"
#include "tests/simulation/planted_fault.h"

namespace treeroll::simulation {

std::vector<RunRecord> faultless_records(const Study& study, const VirtualTask& task,
                                         const std::vector<int>& ends) {
  constexpr const char* kCrashReason =
      "3 evaluators ended under it, and the last one was ended by signal 11";
  constexpr const char* kTimeReason = "took more than the task's 0.4 s, 3 times";
  const WithoutFault without_fault;
  std::vector<RunRecord> records;
  for (int index = 0; index < study.num_runs(); ++index) {
    learner::Run run(study, index);
    int num_applied = 0;
    const auto stop_if_due = [&] {
      if (!ends.empty() && num_applied == ends[static_cast<std::size_t>(index)]) run.stop();
    };
    stop_if_due();
    std::map<int, explore::Draw> asked;
    while (!run.done()) {
      for (explore::Draw& draw : run.take_draws()) asked.emplace(draw.rollout, std::move(draw));
      // The lowest number first, a trial that is made again too: applied one by one, none is
      // applied past the end of the study's time.
      const explore::Draw draw = asked.extract(asked.begin()).mapped();
      const protocol::RolloutKey key{index, draw.rollout};
      const std::vector<double> theta(draw.theta.data(), draw.theta.data() + draw.theta.size());
      const std::int64_t seed =
          learner::task_seed(study, run.repetition(), draw.rollout, run.num_discards(draw.rollout));
      Outcome outcome = task.outcome(key, seed, theta);
      // Said by the worker, not by its task.
      const RolloutStatus status = outcome.status();
      if (status == RolloutStatus::kCrashed) outcome = {0, status, kCrashReason};
      if (status == RolloutStatus::kTimedOut) outcome = {0, status, kTimeReason};
      num_applied += run.accept(draw.rollout, outcome, 0);
      stop_if_due();
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
    } else if (const auto* signals = std::get_if<TaskSignals>(&record)) {
      core.step(TimePoint{}, learner::SignalsRecovered{*signals}, effects);
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
    if (x.reason != y.reason) return false;
  }
  return a.final_reward == b.final_reward && a.switches == b.switches && a.start == b.start &&
         a.finals == b.finals && a.final_policy == b.final_policy &&
         a.num_discarded == b.num_discarded && a.reasons == b.reasons &&
         a.best_rollout == b.best_rollout && a.best_reward == b.best_reward &&
         a.best_policy == b.best_policy;
}

}  // namespace treeroll::simulation
