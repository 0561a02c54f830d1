#pragma once

namespace treeroll {

class TaskRegistry;

/// The whole of a worker executable: options, daemon, evaluators, --describe-task. A worker with
/// tasks of one's own is one file:
///
///   int main(int argc, char** argv) {
///     treeroll::TaskRegistry registry;
///     treeroll::add_standard_tasks(registry);
///     treeroll::add_task<ReachTask>(registry, "reach");
///     return treeroll::worker_main(argc, argv, registry);
///   }
///
/// It starts itself again for each evaluator, so nothing with an effect may come before it.
/// @return  exit status: 0 done, 2 bad input, 1 anything else
int worker_main(int argc, char** argv, const TaskRegistry& registry);

}  // namespace treeroll
