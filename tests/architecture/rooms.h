#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace treeroll::architecture {

/// What a room is beyond its arrows.
struct Room {
  std::set<std::string> arrows;  ///< rooms it may include directly
  /// A pure function of what it is given: no clocks, random devices, threads, disk or network.
  bool is_core = false;
  /// What it computes may reach a perturbation or a reward: the same bits on every machine, so
  /// neither random sources of its own nor glibc's elementary functions.
  bool is_portable = false;
};

/// The rooms and their arrows, by folder.
const std::map<std::string, Room>& rooms();

/// The room a path from the root lies in; empty if none.
std::string room_of(std::string_view path);

/// Rooms that `room` may include: along any number of arrows, and itself.
std::set<std::string> reachable(const std::string& room);

}  // namespace treeroll::architecture
