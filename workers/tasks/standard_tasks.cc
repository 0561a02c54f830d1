#include "workers/tasks/hold_task.h"
#include "workers/tasks/swing_up_and_hold_task.h"
#include "workers/tasks/synthetic_task.h"
#include "workers/tasks/track_task.h"
#include "workers/tasks/trajectory_task.h"

namespace treeroll {

void add_standard_tasks(TaskRegistry& registry) {
  add_task<HoldTask>(registry, "hold");
  registry.add("spiral", TrajectoryTask::spiral);
  registry.add("swing_up", make_swing_up);
  add_task<SyntheticTask>(registry, "synthetic");
  add_task<TrackTask>(registry, "track");
  registry.add("trajectory", TrajectoryTask::with_goal);
}

}  // namespace treeroll
