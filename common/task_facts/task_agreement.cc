#include "common/task_facts/task_agreement.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "common/base/config_error.h"
#include "common/base/cut_text.h"

namespace treeroll {
namespace {

using nlohmann::json;

/// An error is for a person, and a worker's goes into one message.
constexpr std::size_t kValueBytesMax = 60;

std::string shortened(const json& value) {
  return cut_text(value.dump(-1, ' ', false, json::error_handler_t::replace), kValueBytesMax);
}

/// The first place at which two values differ is refused; its key begins with `path`.
void compare(const json& expected, const json& found, const std::string& path) {
  if (!expected.is_object() || !found.is_object()) {
    if (expected == found) return;
    throw ConfigError(path, shortened(found),
                      fmt::format("was {} when the study began", shortened(expected)));
  }
  std::set<std::string> keys;
  for (const json* both : {&expected, &found}) {
    for (const auto& [key, value] : both->items()) keys.insert(key);
  }
  for (const std::string& key : keys) {
    const std::string below = path + "." + key;
    if (!expected.contains(key)) {
      throw ConfigError(below, shortened(found[key]), "did not exist when the study began");
    }
    if (!found.contains(key)) {
      throw ConfigError(below, "",
                        fmt::format("was {} when the study began, and does not exist here",
                                    shortened(expected[key])));
    }
    compare(expected[key], found[key], below);
  }
}

/// A description with what it leaves out where that is the default.
json in_full(json description) {
  if (!description.is_object()) return description;
  description.emplace("repeatable", true);
  description.emplace("version", "");
  return description;
}

}  // namespace

std::string task_content(const std::string& name, const json& settings,
                         const TaskDescription* described) {
  json content{{"name", name}, {"settings", settings}};
  if (described) content["described"] = to_json(*described);
  return content.dump();
}

std::optional<TaskDescription> described_in(const std::string& content) {
  const json object = json::parse(content, nullptr, false);
  const auto described = object.find("described");
  if (!object.is_object() || described == object.end()) return std::nullopt;
  const Result<TaskDescription> read = task_description_from_json(described->dump());
  return read ? std::optional(*read) : std::nullopt;
}

void check_agreement(const json& content, const json& settings,
                     const TaskDescription& description) {
  const auto described = content.find("described");
  if (described == content.end()) return;
  try {
    compare(content.at("settings"), settings, "task");
    compare(in_full(*described), in_full(to_json(description)), "task.described");
  } catch (const ConfigError& error) {
    throw ConfigError(error.key(), error.value(),
                      error.rule() +
                          ": this worker program's task is another one; in a study that "
                          "you changed yourself, remove [task.described]");
  }
}

std::optional<std::string> disagreement(const TaskDescription& expected,
                                        const TaskDescription& found) {
  try {
    compare(in_full(to_json(expected)), in_full(to_json(found)), "task.described");
    return difference(found.signals, "this study calls them", expected.signals);
  } catch (const ConfigError& error) {
    return error.what();
  }
}

}  // namespace treeroll
