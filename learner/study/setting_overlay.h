#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "learner/study/study_error.h"

namespace treeroll {

/// Settings that lie over others, and where they stand (by key relative to `settings`).
struct SettingOverlay {
  SettingOverlay();
  SettingOverlay(const nlohmann::json& settings, SettingOrigins origins);

  std::shared_ptr<nlohmann::json> settings;  ///< never null, an object
  SettingOrigins origins;
};

/// Merges the overlay's tables into `target` key by key; its other values replace what is there.
void lay_over(nlohmann::json& target, SettingOrigins& origins, const SettingOverlay& overlay);

/// Sets target.key[0].key[1]... = value, replacing on its way what is no table.
void set_below(nlohmann::json& target, const std::vector<std::string>& key,
               const nlohmann::json& value);

/// The parts of a dotted key; an empty list if one of them is empty.
std::vector<std::string> split_key(const std::string& dotted);

/// Origins of what stands below `path`, by key relative to it, with that of `path` as the whole's.
SettingOrigins origins_below(const SettingOrigins& origins, const std::string& path);

/// Forgets what stands below `path`.
void erase_below(SettingOrigins& origins, const std::string& path);

}  // namespace treeroll
