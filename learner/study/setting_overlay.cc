#include "learner/study/setting_overlay.h"

#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

namespace treeroll {
namespace {

using nlohmann::json;

void merge(json& target, SettingOrigins& origins, const json& source,
           const SettingOrigins& source_origins, const std::string& path) {
  if (source.is_object() && target.is_object()) {
    for (const auto& [key, value] : source.items()) {
      merge(target[key], origins, value, source_origins, path.empty() ? key : path + "." + key);
    }
    return;
  }
  erase_below(origins, path);
  origins[path] = origin_of(source_origins, path);
  target = source;
  for (const auto& [key, location] : origins_below(source_origins, path)) {
    if (!key.empty()) origins[path + "." + key] = location;
  }
}

}  // namespace

SettingOverlay::SettingOverlay() : SettingOverlay(json::object(), {}) {}

SettingOverlay::SettingOverlay(const json& s, SettingOrigins o)
    : settings(std::make_shared<json>(s)), origins(std::move(o)) {}

void lay_over(json& target, SettingOrigins& origins, const SettingOverlay& overlay) {
  merge(target, origins, *overlay.settings, overlay.origins, "");
}

void set_below(json& target, const std::vector<std::string>& key, const json& value) {
  json* place = &target;
  for (const std::string& part : key) {
    if (!place->is_object()) *place = json::object();
    place = &(*place)[part];
  }
  *place = value;
}

std::vector<std::string> split_key(const std::string& dotted) {
  std::vector<std::string> parts;
  std::istringstream stream(dotted + ".");
  for (std::string part; std::getline(stream, part, '.');) {
    if (part.empty()) return {};
    parts.push_back(part);
  }
  return parts;
}

SettingOrigins origins_below(const SettingOrigins& origins, const std::string& path) {
  SettingOrigins below;
  below[""] = origin_of(origins, path);
  const std::string prefix = path + ".";
  for (auto i = origins.lower_bound(prefix); i != origins.end() && i->first.starts_with(prefix);
       ++i) {
    below[i->first.substr(prefix.size())] = i->second;
  }
  return below;
}

void erase_below(SettingOrigins& origins, const std::string& path) {
  for (const char* separator : {".", "["}) {
    const std::string prefix = path + separator;
    auto i = origins.lower_bound(prefix);
    while (i != origins.end() && i->first.starts_with(prefix)) i = origins.erase(i);
  }
}

}  // namespace treeroll
