#include "tests/simulation/virtual_task.h"

#include "common/task_facts/task_description.h"
#include "tests/learner_core/fake_worker.h"
#include "tests/simulation/dice.h"

namespace treeroll::simulation {

const char* const kTaskContent = R"({"name":"bump","settings":{}})";

std::string task_description(const TaskBehaviour& behaviour, bool names_signals) {
  TaskDescription task{
      .input_dim = 1, .output_dim = 1, .time_limit_s = to_seconds(behaviour.time_limit)};
  if (names_signals) task.signals = {{"time_s"}, {"force_n"}};
  return report_text(task);
}

Fate VirtualTask::fate(protocol::RolloutKey key) const {
  Dice dice(seed_, 1000 + static_cast<std::uint32_t>(key.run),
            static_cast<std::uint32_t>(key.number + 1));
  double drawn = dice.between(0., 1.);
  if ((drawn -= behaviour_.crashing) < 0) return Fate::kCrashes;
  if ((drawn -= behaviour_.hanging) < 0) return Fate::kHangs;
  if ((drawn -= behaviour_.diverging) < 0) return Fate::kDiverges;
  if ((drawn -= behaviour_.flaky) < 0) return Fate::kFlaky;
  return Fate::kFine;
}

Outcome VirtualTask::outcome(protocol::RolloutKey key, std::int64_t task_seed,
                             const std::vector<double>& theta) const {
  const Fate drawn = fate(key);
  if (drawn == Fate::kCrashes) return Outcome::failed(RolloutStatus::kCrashed);
  if (drawn == Fate::kHangs) return Outcome::failed(RolloutStatus::kTimedOut);
  Dice trial(seed_, 100'000 + static_cast<std::uint32_t>(key.run),
             static_cast<std::uint32_t>(task_seed));
  if (trial.chance(behaviour_.discarding)) return Outcome::discarded("the trial is void");
  if (drawn == Fate::kDiverges) {
    return Outcome::failed(RolloutStatus::kDiverged,
                           "roll-outs of run " + std::to_string(key.run) + " may diverge");
  }
  return Outcome::ok(learner::bump(theta));
}

}  // namespace treeroll::simulation
