#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace treeroll {

class SettingsReader;

/// The keys of a study file outside of its four tables, each with its rule. They throw ConfigError.
std::optional<std::string> read_extends(SettingsReader& study);
const nlohmann::json& read_conditions(SettingsReader& study);
const nlohmann::json& read_axes(SettingsReader& study);
/// Of a condition, or of an option of an axis.
std::string read_condition_name(SettingsReader& condition);
/// Of an axis; may be absent.
void read_axis_name(SettingsReader& axis);
std::string read_axis_key(SettingsReader& axis);
const nlohmann::json& read_axis_values(SettingsReader& axis);
const nlohmann::json& read_axis_options(SettingsReader& axis);

}  // namespace treeroll
