#include "learner/study/study_document.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>

#include "common/protocol/limits.h"
#include "common/settings/settings_reader.h"
#include "learner/study/document_keys.h"
#include "learner/study/resolved_study.h"
#include "learner/study/setting_overlay.h"
#include "learner/study/study_source.h"
#include "learner/study/toml_source.h"

namespace treeroll {
namespace {

using nlohmann::json;

using protocol::kConditionsMax;

constexpr std::size_t kNameBytesMax = 128;
constexpr std::array<std::string_view, 4> kTables{"study", "task", "policy", "exploration"};

/// What a resolved study has beside its settings.
constexpr std::array<std::string_view, 3> kAttached{"demonstrations", "starts", "written_by"};

bool is_attached(std::string_view key) {
  return std::find(kAttached.begin(), kAttached.end(), key) != kAttached.end();
}

bool is_table_name(std::string_view key) {
  return std::find(kTables.begin(), kTables.end(), key) != kTables.end();
}

/// What one value of one factor (the conditions, or an axis) adds to the settings.
struct Factor {
  std::string name;  ///< part of the condition's name; may be empty for the only one
  std::string location;
  SettingOverlay overlay;
};

constexpr const char* kStudyRule =
    "only study.rollouts and study.in_flight may differ between the conditions of a study";

bool may_differ(std::string_view study_key) {
  return study_key == "rollouts" || study_key == "in_flight";
}

/// What a condition or an option may hold beside its name.
void check_tables(const json& settings, const std::string& path) {
  for (const auto& [key, table] : settings.items()) {
    const std::string full = path + "." + key;
    if (!is_table_name(key)) {
      throw ConfigError(full, "",
                        fmt::format("unknown key; known here: name, {}", fmt::join(kTables, ", ")));
    }
    if (!table.is_object()) throw ConfigError(full, "", "must be a table");
    if (key != "study") continue;
    for (const auto& [below, value] : table.items()) {
      if (!may_differ(below)) throw ConfigError(full + "." + below, "", kStudyRule);
    }
  }
}

/// An entry of [[conditions]] or of an axis's options: a name, and settings.
Factor read_named(const json& entry, const std::string& path, const SettingOrigins& origins) {
  json scratch;
  SettingsReader reader(entry, path, scratch);
  Factor factor;
  factor.name = read_condition_name(reader);
  factor.location = origin_of(origins, path + ".name");
  factor.overlay = SettingOverlay(entry, origins_below(origins, path));
  factor.overlay.settings->erase("name");
  check_tables(*factor.overlay.settings, path);
  return factor;
}

/// A value of an axis as it stands in the condition's name.
std::string name_of(const json& value, const std::string& path) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  if (!value.is_structured()) return value.dump();
  std::vector<std::string> parts;
  for (const json& element : value) {
    if (value.is_object() || element.is_structured()) {
      throw ConfigError(path, "", "must be numbers, words or lists of them; see options");
    }
    parts.push_back(name_of(element, path));
  }
  return fmt::format("{}", fmt::join(parts, "_"));
}

/// An axis of one key with its values.
std::vector<Factor> read_values(SettingsReader& reader, const std::string& path,
                                const SettingOrigins& origins, std::vector<std::string>& keys) {
  const std::string key = read_axis_key(reader);
  const std::vector<std::string> parts = split_key(key);
  if (parts.size() < 2 || !is_table_name(parts.front())) {
    reader.refuse(
        "key", fmt::format("must be the dotted key of a setting in {}", fmt::join(kTables, ", ")));
  }
  if (parts[0] == "study" && !(parts.size() == 2 && may_differ(parts[1]))) {
    reader.refuse("key", kStudyRule);
  }
  keys.push_back(key);
  std::vector<Factor> factors;
  for (const json& value : read_axis_values(reader)) {
    Factor factor;
    factor.location = origin_of(origins, path + ".values");
    factor.name = fmt::format("{}={}", parts.back(), name_of(value, path + ".values"));
    factor.overlay = SettingOverlay(json::object(), {{"", factor.location}});
    set_below(*factor.overlay.settings, parts, value);
    factors.push_back(std::move(factor));
  }
  return factors;
}

/// Adds each value below a table to those of its dotted key.
void add_values(const json& table, const std::string& path,
                std::map<std::string, std::vector<json>>& values) {
  for (const auto& [key, value] : table.items()) {
    const std::string full = path.empty() ? key : path + "." + key;
    if (value.is_object()) {
      add_values(value, full, values);
    } else {
      values[full].push_back(value);
    }
  }
}

/// The keys that the options do not all have with the same value: what their names stand for.
void add_varied_keys(const std::vector<Factor>& options, std::vector<std::string>& keys) {
  std::map<std::string, std::vector<json>> values;
  for (const Factor& option : options) add_values(*option.overlay.settings, "", values);
  for (const auto& [key, given] : values) {
    const bool differs = std::ranges::adjacent_find(given, std::not_equal_to{}) != given.end();
    if (differs || given.size() < options.size()) keys.push_back(key);
  }
}

std::vector<Factor> read_axis(const json& axis, const std::string& path,
                              const SettingOrigins& origins, std::vector<std::string>& keys) {
  if (!axis.is_object()) throw ConfigError(path, "", "must be a table");
  json scratch;
  SettingsReader reader(axis, path, scratch);
  read_axis_name(reader);
  const bool has_options = reader.has("options");
  for (const auto& [key, value] : axis.items()) {
    if (key == "name") continue;
    if (has_options ? key == "options" : key == "key" || key == "values") continue;
    throw ConfigError(path + "." + key, "",
                      "an axis has either key and values, or options; and a name, or none");
  }
  if (!has_options) return read_values(reader, path, origins, keys);
  std::vector<Factor> factors;
  for (const json& option : read_axis_options(reader)) {
    const std::string below = fmt::format("{}.options[{}]", path, factors.size());
    factors.push_back(read_named(option, below, origins));
  }
  add_varied_keys(factors, keys);
  return factors;
}

}  // namespace

struct StudyDocument::Parts {
  SettingOverlay base;
  json attached = json::object();
  std::vector<std::vector<Factor>> factors;  ///< the conditions, then each axis
  SettingOverlay command_line;

  /// The factors of a condition, the last one running fastest.
  std::vector<const Factor*> of(std::size_t condition) const {
    std::vector<const Factor*> chosen(factors.size());
    for (std::size_t i = factors.size(); i-- > 0;) {
      chosen[i] = &factors[i][condition % factors[i].size()];
      condition /= factors[i].size();
    }
    return chosen;
  }
};

namespace {

/// Puts each override into the document itself (conditions, axes) or into the returned settings,
/// which win over everything.
SettingOverlay apply_overrides(const std::vector<std::string>& overrides, json& document,
                               SettingOrigins& origins) {
  SettingOverlay settings(json::object(), {{"", kCommandLineOrigin}});
  for (const std::string& argument : overrides) {
    const SettingOverride setting = parse_override(argument);
    json value;
    parse_override_value(setting, value);
    const std::string& first = setting.key.front();
    if (setting.key.size() == 1 && (first == "conditions" || first == "axes")) {
      document[first] = value;
      erase_below(origins, first);
      origins[first] = kCommandLineOrigin;
      continue;
    }
    const std::string key = fmt::format("{}", fmt::join(setting.key, "."));
    if (!is_table_name(first)) {
      throw StudyError(kCommandLineOrigin,
                       ConfigError(key, setting.text,
                                   fmt::format("unknown key; known here: conditions, "
                                               "axes, and those below {}",
                                               fmt::join(kTables, ", "))));
    }
    if (setting.key.size() == 1 && !value.is_object()) {
      throw StudyError(kCommandLineOrigin, ConfigError(key, setting.text, "must be a table"));
    }
    json nested = json::object();
    set_below(nested, setting.key, value);
    lay_over(*settings.settings, settings.origins,
             SettingOverlay(nested, {{"", kCommandLineOrigin}}));
  }
  return settings;
}

void refuse_overrides_of_axes(const std::vector<std::string>& overrides,
                              const std::vector<std::string>& axis_keys) {
  for (const std::string& argument : overrides) {
    const std::string key = argument.substr(0, argument.find('=')) + ".";
    for (const std::string& axis : axis_keys) {
      if (!key.starts_with(axis + ".") && !(axis + ".").starts_with(key)) continue;
      throw StudyError(kCommandLineOrigin,
                       ConfigError(argument, "",
                                   fmt::format("{} is varied by an axis of this study; "
                                               "override axes instead",
                                               axis)));
    }
  }
}

/// Names go into tables, files and messages.
void check_name(const std::string& name) {
  const auto usable = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_.=+-").find(c) != std::string_view::npos;
  };
  const bool starts_well = !name.empty() && name[0] != '.' && name[0] != '-';
  if (starts_well && name.size() <= kNameBytesMax &&
      std::all_of(name.begin(), name.end(), usable)) {
    return;
  }
  throw ConfigError(
      "conditions.name",
      json(name.substr(0, kNameBytesMax)).dump(-1, ' ', false, json::error_handler_t::replace),
      fmt::format("must be 1 to {} letters, digits and _ . = + -, and begin with "
                  "none of . and -",
                  kNameBytesMax));
}

}  // namespace

StudyDocument::StudyDocument(const std::filesystem::path& file,
                             const std::vector<std::string>& overrides)
    : parts_(std::make_unique<Parts>()) {
  json document;
  SettingOrigins origins = read_study_source(file, document, &text_);
  refuse_later_form(document, origins);
  parts_->command_line = apply_overrides(overrides, document, origins);
  try {
    json base = json::object();
    std::vector<std::string> axis_keys;
    for (const std::string_view table : kTables) base[std::string(table)] = json::object();
    for (const auto& [key, value] : document.items()) {
      if (is_table_name(key) || is_attached(key)) {
        if (!value.is_object()) throw ConfigError(key, value.dump(), "must be a table");
        (is_attached(key) ? parts_->attached : base)[key] = value;
      } else if (key != "conditions" && key != "axes") {
        throw ConfigError(key, "",
                          fmt::format("unknown key; known here: extends, {}, conditions, axes",
                                      fmt::join(kTables, ", ")));
      }
    }
    json scratch;
    SettingsReader lists(document, "", scratch);
    if (lists.has("conditions")) {
      std::vector<Factor> conditions;
      for (const json& entry : read_conditions(lists)) {
        conditions.push_back(
            read_named(entry, fmt::format("conditions[{}]", conditions.size()), origins));
      }
      parts_->factors.push_back(std::move(conditions));
    }
    if (lists.has("axes")) {
      std::size_t index = 0;
      for (const json& axis : read_axes(lists)) {
        parts_->factors.push_back(
            read_axis(axis, fmt::format("axes[{}]", index++), origins, axis_keys));
      }
    }
    if (parts_->factors.empty()) {
      throw ConfigError("conditions", "", "is missing: a study has [[conditions]] or [[axes]]");
    }
    refuse_overrides_of_axes(overrides, axis_keys);
    std::size_t num_conditions = 1;
    for (const auto& factor : parts_->factors) {
      num_conditions *= factor.size();
      if (num_conditions <= kConditionsMax) continue;
      throw ConfigError(document.contains("axes") ? "axes" : "conditions", "",
                        fmt::format("make {} conditions or more: must be at most {}",
                                    num_conditions, kConditionsMax));
    }
    names_.resize(num_conditions);
    std::erase_if(origins, [](const auto& origin) {
      return origin.first.starts_with("conditions") || origin.first.starts_with("axes");
    });
    parts_->base = SettingOverlay(base, std::move(origins));
  } catch (const ConfigError& error) {
    throw StudyError(origin_of(origins, error.key()), error);
  }
  std::set<std::string, std::less<>> taken;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    std::vector<std::string> parts;
    const std::vector<const Factor*> chosen = parts_->of(i);
    for (const Factor* factor : chosen) parts.push_back(factor->name);
    names_[i] = fmt::format("{}", fmt::join(parts, "."));
    try {
      check_name(names_[i]);
      if (!taken.insert(names_[i]).second) {
        throw ConfigError("conditions.name", json(names_[i]).dump(), "must be unique");
      }
    } catch (const ConfigError& error) {
      throw StudyError(chosen.front()->location, error);
    }
  }
}

StudyDocument::~StudyDocument() = default;

const json& StudyDocument::attached() const { return parts_->attached; }

const SettingOrigins& StudyDocument::attached_origins() const { return parts_->base.origins; }

SettingOrigins StudyDocument::settings(std::size_t condition, json& settings) const {
  settings = *parts_->base.settings;
  SettingOrigins origins = parts_->base.origins;
  for (const Factor* factor : parts_->of(condition)) lay_over(settings, origins, factor->overlay);
  lay_over(settings, origins, parts_->command_line);
  return origins;
}

}  // namespace treeroll
