#include "tests/architecture/rooms.h"

namespace treeroll::architecture {

const std::map<std::string, Room>& rooms() {
  static const std::map<std::string, Room> table = {
      {"lcmtypes", {}},
      {"common/base", {.arrows = {}, .is_core = true, .is_portable = true}},
      {"common/policy", {.arrows = {"common/base"}, .is_core = true, .is_portable = true}},
      {"common/protocol", {.arrows = {"common/base"}, .is_core = true}},
      {"common/transport", {.arrows = {"common/protocol", "lcmtypes"}}},
      {"sim", {.arrows = {"common/base"}, .is_portable = true}},
      {"workers/tasks", {.arrows = {"sim", "common/policy"}, .is_portable = true}},
      {"workers/core", {.arrows = {"common/policy", "common/protocol"}, .is_core = true}},
      {"workers/app", {.arrows = {"workers/core", "workers/tasks", "common/transport"}}},
      {"learner/fit", {.arrows = {"common/policy"}, .is_core = true, .is_portable = true}},
      {"learner/explore", {.arrows = {"common/policy"}, .is_core = true, .is_portable = true}},
      {"learner/core",
       {.arrows = {"learner/explore", "learner/fit", "common/protocol"}, .is_core = true}},
      {"learner/journal", {.arrows = {"learner/core"}}},
      {"learner/report", {.arrows = {"learner/core"}}},
      {"learner/figures", {.arrows = {"learner/report"}}},
      {"learner/app",
       {.arrows = {"learner/core", "learner/journal", "learner/figures", "common/transport"}}},
      {"deploy/own_task", {.arrows = {"workers/app"}, .is_portable = true}},
  };
  return table;
}

std::string room_of(std::string_view path) {
  for (const auto& [folder, room] : rooms()) {
    if (path.starts_with(folder) && path.substr(folder.size()).starts_with('/')) return folder;
  }
  return "";
}

std::set<std::string> reachable(const std::string& room) {
  std::set<std::string> found = {room};
  for (const std::string& next : rooms().at(room).arrows) found.merge(reachable(next));
  return found;
}

}  // namespace treeroll::architecture
