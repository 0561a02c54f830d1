#include "tests/simulation/virtual_task.h"

#include "tests/learner_core/fake_worker.h"
#include "tests/simulation/dice.h"

namespace treeroll::simulation {

const char* const kTaskContent = R"({"name":"bump","settings":{}})";

std::string task_description(const TaskBehaviour& behaviour) {
  return R"({"deterministic":true,"input_dim":1,"output_dim":1,"reward_max":1.0,"reward_min":0.0,"time_limit_s":)" +
         std::to_string(to_seconds(behaviour.time_limit)) + "}";
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

RolloutStatus VirtualTask::status(protocol::RolloutKey key) const {
  switch (fate(key)) {
    case Fate::kCrashes:
      return RolloutStatus::kCrashed;
    case Fate::kHangs:
      return RolloutStatus::kTimedOut;
    case Fate::kDiverges:
      return RolloutStatus::kDiverged;
    case Fate::kFine:
    case Fate::kFlaky:
      break;
  }
  return RolloutStatus::kOk;
}

double VirtualTask::reward(protocol::RolloutKey key, const std::vector<double>& theta) const {
  return status(key) == RolloutStatus::kOk ? learner::bump(theta) : 0;
}

}  // namespace treeroll::simulation
