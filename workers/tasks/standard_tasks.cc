#include "workers/tasks/swing_up_task.h"
#include "workers/tasks/synthetic_task.h"

namespace treeroll {

void add_standard_tasks(TaskRegistry& registry) {
  add_task<SwingUpTask>(registry, "swing_up");
  add_task<SyntheticTask>(registry, "synthetic");
}

}  // namespace treeroll
