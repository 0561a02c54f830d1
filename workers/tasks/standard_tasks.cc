#include "sim/ode_canary.h"
#include "workers/tasks/hold_task.h"
#include "workers/tasks/swing_up_and_hold_task.h"
#include "workers/tasks/synthetic_task.h"
#include "workers/tasks/track_task.h"
#include "workers/tasks/trajectory_task.h"

namespace treeroll {
namespace {

constexpr const char* kSwingUpStart =
    R"([policy]               # the thesis's demonstration, fitted by a tree of Gaussian mixtures
model = "top_down_tree"    # or "tree", "flat"; or kind = "spline", another kind of policy

[exploration]          # without a key the noise follows from what theta does to the output
)";

}  // namespace

void add_standard_tasks(TaskRegistry& registry) {
  add_task<HoldTask>(registry, "hold");
  registry.add("spiral", TrajectoryTask::spiral);
  registry.add("swing_up", make_swing_up, kSwingUpStart);
  add_task<SyntheticTask>(registry, "synthetic");
  add_task<TrackTask>(registry, "track");
  registry.add("trajectory", TrajectoryTask::with_goal);
  registry.depends_on("ode", sim::ode_canary);
}

}  // namespace treeroll
