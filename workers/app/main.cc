#include "workers/app/worker_main.h"
#include "workers/tasks/task.h"

int main(int argc, char** argv) {
  treeroll::TaskRegistry registry;
  treeroll::add_standard_tasks(registry);
  return treeroll::worker_main(argc, argv, registry);
}
