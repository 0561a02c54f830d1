#include "learner/study/study_source.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "common/settings/settings_reader.h"
#include "learner/study/document_keys.h"
#include "learner/study/setting_overlay.h"
#include "learner/study/toml_source.h"

namespace treeroll {
namespace {

using nlohmann::json;

struct Source {
  json content;
  SettingOrigins origins;
  std::string text;
};

bool has_name_of(const json& entry, const json& other) {
  return entry.is_object() && other.is_object() && entry.contains("name") &&
         other.contains("name") && entry.at("name") == other.at("name");
}

/// Puts the entries of source[key] into the list target[key], by name or behind.
void extend_list(Source& target, const Source& source, const std::string& key) {
  json& list = target.content[key];
  std::size_t from = 0;
  for (const json& entry : source.content.at(key)) {
    std::size_t to = 0;
    while (to < list.size() && !has_name_of(list[to], entry)) ++to;
    if (to == list.size()) list.push_back(nullptr);
    list[to] = entry;
    const std::string place = fmt::format("{}[{}]", key, to);
    erase_below(target.origins, place);
    const std::string source_place = fmt::format("{}[{}]", key, from++);
    for (const auto& [below, location] : origins_below(source.origins, source_place)) {
      target.origins[below.empty() ? place : place + "." + below] = location;
    }
  }
}

/// `source` over `target`.
void extend(Source& target, Source source) {
  for (const std::string key : {"conditions", "axes"}) {
    // What is no list is refused later, with its place, as in a file that extends nothing.
    const auto own = source.content.find(key);
    const auto extended = target.content.find(key);
    if (own == source.content.end() || extended == target.content.end()) continue;
    if (!own->is_array() || !extended->is_array()) continue;
    extend_list(target, source, key);
    source.content.erase(key);
  }
  lay_over(target.content, target.origins, SettingOverlay(source.content, source.origins));
  target.origins[""] = source.origins.at("");  // what is missing is missing in the extending file
}

Source read(const std::filesystem::path& file, int num_files) {
  Source source;
  source.origins = read_toml_file(file, source.content, "[study] and a condition", &source.text);
  json scratch;
  SettingsReader reader(source.content, "", scratch);
  std::optional<std::string> other;
  try {
    other = read_extends(reader);
    if (other && num_files == kExtendedFilesMax) {
      reader.refuse(
          "extends",
          fmt::format("is one file too many: must be at most {}, each extending the next; "
                      "do they extend each other?",
                      kExtendedFilesMax));
    }
  } catch (const ConfigError& error) {
    throw StudyError(origin_of(source.origins, "extends"), error);
  }
  if (!other) return source;
  Source extended = read(file.parent_path() / *other, num_files + 1);
  source.content.erase("extends");
  extended.text = std::move(source.text);
  extend(extended, std::move(source));
  return extended;
}

}  // namespace

SettingOrigins read_study_source(const std::filesystem::path& file, json& content,
                                 std::string* text) {
  Source source = read(file, 1);
  content = std::move(source.content);
  if (text) *text = std::move(source.text);
  return std::move(source.origins);
}

}  // namespace treeroll
