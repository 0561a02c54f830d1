// Runs that go on to their next layer.
#include <fmt/format.h>

#include "learner/core/learner_core.h"

namespace treeroll::learner {

/// One a turn, since the start of a layer may take seconds: what comes meanwhile is read before the
/// next.
void LearnerCore::make_next_switch(const Turn& turn) {
  Run& run = runs_[at_switch_.front()];
  at_switch_.pop_front();
  advance(turn, run,
          [&](const std::function<void(int)>& on_applied) { return run.make_switch(on_applied); });
  if (run.is_at_switch()) at_switch_.push_back(run.index());
}

void LearnerCore::advance(const Turn& turn, Run& run,
                          const std::function<int(const std::function<void(int)>&)>& step) {
  changed_runs_.insert(run.index());
  const std::size_t num_switches = run.exploration().switches().size();
  std::function<void(int)> on_applied;
  if (on_applied_) on_applied = [&](int number) { on_applied_(run, number); };
  num_applied_ += step(on_applied);
  if (at_work_since_) tell_of_switches(turn, run, num_switches);
  if (at_work_since_) tell_of_final_evaluations(turn, run);
  if (run.done()) {
    finish_run(turn, run);
  } else {
    draw(turn, run);
  }
}

/// @param from  switches before are known
void LearnerCore::tell_of_switches(const Turn& turn, const Run& run, std::size_t from) const {
  const explore::Exploration& exploration = run.exploration();
  const Condition& condition = study_.conditions[run.condition()];
  for (std::size_t i = from; i < exploration.switches().size(); ++i) {
    const int left = condition.exploration.first_layer + static_cast<int>(i);
    turn.inform(
        "layer switches",
        fmt::format("run {} ({}, repetition {}): layer {} is left after {} roll-outs, the "
                    "slope is {:.3g}; layer {} is explored",
                    run.index(), condition.name, run.repetition(), left,
                    exploration.switches()[i] + 1, exploration.slopes_at_switches()[i], left + 1));
  }
}

}  // namespace treeroll::learner
