#include "tests/architecture/rooms.h"

namespace treeroll::architecture {

const std::map<std::string, Room>& rooms() {
  static const std::map<std::string, Room> table = {
      {"lcmtypes", {}},
      {"common/numbers", {.arrows = {}, .is_core = true, .is_portable = true}},
      {"common/base", {.arrows = {}, .is_core = true, .is_portable = true}},
      {"common/settings", {.arrows = {"common/base"}, .is_core = true, .is_portable = true}},
      {"common/task_facts", {.arrows = {"common/settings"}, .is_core = true, .is_portable = true}},
      {"common/files", {.arrows = {"common/base"}}},
      {"common/program", {.arrows = {"common/base"}}},
      {"common/mixture",
       {.arrows = {"common/settings", "common/numbers"}, .is_core = true, .is_portable = true}},
      {"common/policy", {.arrows = {"common/settings"}, .is_core = true, .is_portable = true}},
      {"common/policy/tree",
       {.arrows = {"common/policy", "common/mixture"}, .is_core = true, .is_portable = true}},
      {"common/policy/ds_gmr",
       {.arrows = {"common/policy/tree", "common/numbers"}, .is_core = true, .is_portable = true}},
      {"common/policy/linear",
       {.arrows = {"common/policy", "common/numbers"}, .is_core = true, .is_portable = true}},
      {"common/policy/network",
       {.arrows = {"common/policy", "common/numbers"}, .is_core = true, .is_portable = true}},
      {"common/policy/kinds",
       {.arrows = {"common/policy/ds_gmr", "common/policy/linear", "common/policy/network",
                   "common/policy/tree"},
        .is_core = true,
        .is_portable = true}},
      {"common/protocol", {.arrows = {"common/base"}, .is_core = true}},
      {"common/transport", {.arrows = {"common/protocol", "common/files", "lcmtypes"}}},
      {"common/keygen", {.arrows = {"common/transport", "common/program"}}},
      {"common/doctor", {.arrows = {"common/transport", "common/program"}}},
      {"sim", {.arrows = {"common/settings", "common/numbers"}, .is_portable = true}},
      {"workers/tasks",
       {.arrows = {"sim", "common/policy", "common/mixture", "common/task_facts"},
        .is_portable = true}},
      {"workers/core", {.arrows = {"common/protocol"}, .is_core = true}},
      {"workers/policy_library", {.arrows = {"common/policy/kinds"}, .is_portable = true}},
      {"workers/user_program", {.arrows = {"workers/tasks"}}},
      {"workers/check_evaluator",
       {.arrows = {"workers/user_program", "common/policy/kinds", "common/files",
                   "common/program"}}},
      {"workers/relay", {.arrows = {"workers/core", "learner/core"}, .is_core = true}},
      {"workers/relay/app", {.arrows = {"workers/relay", "common/transport", "common/program"}}},
      {"workers/app",
       {.arrows = {"workers/core", "workers/user_program", "common/policy/kinds",
                   "common/transport", "common/program"}}},
      {"learner/fit", {.arrows = {"common/policy/kinds"}, .is_core = true, .is_portable = true}},
      {"learner/explore",
       {.arrows = {"common/policy", "common/numbers"}, .is_core = true, .is_portable = true}},
      {"learner/core",
       {.arrows = {"learner/explore", "common/protocol", "common/task_facts"}, .is_core = true}},
      {"learner/journal", {.arrows = {"learner/core", "common/files"}}},
      {"learner/study", {.arrows = {"learner/core", "learner/fit"}}},
      {"learner/results", {.arrows = {"learner/core", "common/files"}}},
      {"learner/state", {.arrows = {"learner/journal", "learner/results", "learner/study"}}},
      {"learner/worker_program", {.arrows = {"learner/study", "common/program"}}},
      {"learner/report/statistics", {.arrows = {"learner/results"}}},
      {"learner/report/figures",
       {.arrows = {"learner/report/statistics", "learner/worker_program"}}},
      {"learner/report", {.arrows = {"learner/report/figures", "learner/state", "common/program"}}},
      {"learner/web/views", {.arrows = {"learner/core"}, .is_core = true}},
      {"learner/web",
       {.arrows = {"learner/web/views", "learner/worker_program", "common/transport",
                   "common/files"}}},
      {"learner/top", {.arrows = {"learner/core", "common/transport", "common/program"}}},
      {"learner/app",
       {.arrows = {"learner/state", "learner/web", "learner/report/figures", "common/program"}}},
      {"deploy/own_task", {.arrows = {"workers/app"}, .is_portable = true}},
  };
  return table;
}

std::string room_of(std::string_view path) {
  // A room within a room is the longer name.
  std::string found;
  for (const auto& [folder, room] : rooms()) {
    const bool is_inside = path.starts_with(folder) && path.substr(folder.size()).starts_with('/');
    if (is_inside && folder.size() > found.size()) found = folder;
  }
  return found;
}

std::set<std::string> reachable(const std::string& room) {
  std::set<std::string> found = {room};
  for (const std::string& next : rooms().at(room).arrows) found.merge(reachable(next));
  return found;
}

}  // namespace treeroll::architecture
