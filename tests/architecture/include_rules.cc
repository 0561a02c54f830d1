#include <map>
#include <regex>
#include <set>

#include "tests/architecture/rooms.h"
#include "tests/architecture/rules.h"

namespace treeroll::architecture {
namespace {

/// What only some rooms may include, whatever the arrows allow.
struct Owned {
  std::regex included;
  std::set<std::string> owners;
  std::string instead;
};

const std::vector<Owned>& owned() {
  static const std::vector<Owned> owned = {
      {std::regex(R"(^lcm/|^(treeroll|lcmtypes)/.*_t\.hpp$)"),
       {"common/transport"},
       "LCM is known to common/transport alone: use common/protocol/messages.h and its Bus"},
      {std::regex(R"(^ode/)"), {"sim"}, "ODE is known to sim alone: use a plant of sim"},
      {std::regex(R"(^Random123/)"),
       {"common/numbers"},
       "use RandomStream of common/numbers/random_stream.h"},
      {std::regex(R"(^common/policy/tree/)"),
       {"common/policy/tree", "common/policy/ds_gmr", "common/policy/kinds", "learner/fit"},
       "what a policy is made of is its kind's business: use Policy of common/policy/policy.h"},
      {std::regex(R"(^CLI/|^spdlog/sinks/)"),
       {"common/program"},
       "options and the log's sink take seconds to compile: use CommandLine and run_main of "
       "common/program/program.h"},
  };
  return owned;
}

std::string join(const std::set<std::string>& words) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : ", ") + word;
  return joined;
}

std::vector<Finding> check_arrow(const SourceFile& file, const Include& include,
                                 const std::string& room) {
  const std::string target = room_of(include.included);
  if (target.empty()) {
    return {{file.path, include.line,
             "\"" + include.included + "\" is in no room: include from the root of the tree, " +
                 "libraries with <>"}};
  }
  const std::set<std::string> allowed = reachable(room);
  if (allowed.contains(target)) return {};
  return {{file.path, include.line,
           room + " may not include " + target + "; it may include: " + join(allowed) +
               " (the arrows stand in tests/architecture/rooms.cc)"}};
}

}  // namespace

std::vector<Finding> check_includes(const SourceFile& file) {
  static const std::regex heavy(
      R"(^(nlohmann/json\.hpp|fmt/|toml\+\+/|boost/asio|boost/numeric/odeint|sodium\.h|spdlog/|sleef\.h|CLI/))");
  static const std::regex disk_or_network(
      R"(^(fstream|iostream|filesystem|thread|mutex|ctime|time\.h|unistd\.h|sys/.*|netinet/.*|boost/asio.*|spdlog/.*)$)");
  const std::string room = room_of(file.path);
  std::vector<Finding> findings;
  if (room.empty()) return findings;
  for (const Include& include : file.includes) {
    bool is_owned = false;
    for (const Owned& rule : owned()) {
      if (!std::regex_search(include.included, rule.included)) continue;
      is_owned = true;
      if (!rule.owners.contains(room)) {
        findings.push_back({file.path, include.line, rule.instead});
      }
    }
    if (include.quoted && !is_owned) {
      for (Finding& finding : check_arrow(file, include, room)) findings.push_back(finding);
    }
    if (file.is_header() && std::regex_search(include.included, heavy)) {
      findings.push_back({file.path, include.line,
                          "<" + include.included +
                              "> costs every includer seconds: include it in " +
                              "the .cc; <nlohmann/json_fwd.hpp> or a forward declaration here"});
    }
    if (rooms().at(room).is_core && std::regex_search(include.included, disk_or_network)) {
      findings.push_back({file.path, include.line,
                          "<" + include.included + "> in a core: time, disk and network are " +
                              "arguments or effects, carried out by the room's caller"});
    }
  }
  return findings;
}

std::vector<Finding> check_own_headers(const std::vector<SourceFile>& files) {
  std::set<std::string> headers;
  for (const SourceFile& file : files) {
    if (file.is_header()) headers.insert(file.path);
  }
  std::vector<Finding> findings;
  for (const SourceFile& file : files) {
    if (!file.path.ends_with(".cc") || room_of(file.path).empty()) continue;
    const std::string own = file.path.substr(0, file.path.size() - 2) + "h";
    if (!headers.contains(own)) continue;
    if (!file.includes.empty() && file.includes.front().included == own) continue;
    findings.push_back({file.path, file.includes.empty() ? 1 : file.includes.front().line,
                        "include \"" + own + "\" first: that is what compiles the header alone"});
  }
  return findings;
}

std::vector<Finding> check_unused_arrows(const std::vector<SourceFile>& files) {
  std::map<std::string, std::set<std::string>> used;
  for (const SourceFile& file : files) {
    for (const Include& include : file.includes) {
      // The types are generated into a folder of the package's name.
      const bool is_type = include.included.starts_with("treeroll/");
      used[room_of(file.path)].insert(is_type ? "lcmtypes" : room_of(include.included));
    }
  }
  std::vector<Finding> findings;
  for (const auto& [name, room] : rooms()) {
    for (const std::string& arrow : room.arrows) {
      if (used[name].contains(arrow)) continue;
      findings.push_back({"tests/architecture/rooms.cc", 1,
                          "nothing in " + name + " includes " + arrow + ": take the arrow out"});
    }
  }
  return findings;
}

}  // namespace treeroll::architecture
