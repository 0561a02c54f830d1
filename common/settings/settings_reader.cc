#include "common/settings/settings_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/config_error.h"
#include "common/settings/number_rule_text.h"
#include "common/settings/settings_record.h"

namespace treeroll {
namespace {

using nlohmann::json;

const json& empty_object() {
  static const json empty = json::object();
  return empty;
}

constexpr std::size_t kShownLength = 80;

/// A value as it is shown in an error; long ones are cut.
std::string shown(const json& value) {
  std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  if (text.size() > kShownLength) text = text.substr(0, kShownLength) + "...";
  return text;
}

}  // namespace

SettingsReader::SettingsReader(const json& table, std::string path, json& resolved,
                               SettingsRecord* record)
    : table_(&table), path_(std::move(path)), resolved_(&resolved), record_(record) {
  if (!table.is_object()) throw ConfigError(path_, shown(table), "must be a table");
  if (!resolved_->is_object()) *resolved_ = json::object();
}

std::string SettingsReader::full(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

const json* SettingsReader::find(std::string_view key) {
  asked_.emplace(key);
  const auto found = table_->find(std::string(key));
  return found == table_->end() ? nullptr : &*found;
}

bool SettingsReader::has(std::string_view key) const {
  if (record_) {
    record_->asked.push_back(full(key));
    record_->asked_whether_there.push_back(full(key));
    if (record_->present.contains(full(key))) return true;
  }
  return table_->find(std::string(key)) != table_->end();
}

const json* SettingsReader::value_of(std::string_view key, bool has_fallback, const KeyHelp& help,
                                     const std::function<KeyNote()>& note) {
  const json* value = find(key);
  if (!record_) {
    if (!value && !has_fallback) throw ConfigError(full(key), "", "is required and missing");
    return value;
  }
  KeyNote noted = note();
  noted.key = full(key);
  record_->asked.push_back(noted.key);
  const std::string fallback = noted.otherwise;
  if (!help.unit.empty()) noted.type += fmt::format(" in {}", help.unit);
  if (!help.rule.empty()) noted.rule = help.rule;
  if (!help.otherwise.empty()) noted.otherwise = help.otherwise;
  noted.meaning = help.meaning;
  const json example =
      help.example.empty() ? json::parse(noted.example) : json::parse(help.example);
  noted.example = help.example;
  if (!value && (!has_fallback || record_->present.contains(noted.key))) {
    value = record_->examples.emplace_back(std::make_shared<const json>(example)).get();
  }
  record_->answers.push_back(value ? value->dump() : fallback);
  record_->notes.push_back(std::move(noted));
  return value;
}

void SettingsReader::refuse(std::string_view key, const std::string& rule) const {
  const auto found = table_->find(std::string(key));
  throw ConfigError(full(key), found == table_->end() ? "" : shown(*found), rule);
}

double SettingsReader::number(std::string_view key, NumberRule rule, std::optional<double> fallback,
                              const KeyHelp& help) {
  const json* value = value_of(key, fallback.has_value(), help, [&] {
    return KeyNote{.key = {},
                   .type = "number",
                   .rule = bounds_text(rule),
                   .otherwise = default_text(fallback),
                   .meaning = {},
                   .example = example_number(rule),
                   .words = {}};
  });
  if (value && (!value->is_number() || !obeys(value->get<double>(), rule))) {
    refuse(key, rule_text(rule));
  }
  const double number = value ? value->get<double>() : *fallback;
  (*resolved_)[std::string(key)] = number;
  return number;
}

std::optional<double> SettingsReader::optional_number(std::string_view key, NumberRule rule,
                                                      const KeyHelp& help) {
  if (!record_) return find(key) ? std::optional(number(key, rule)) : std::nullopt;
  KeyHelp of_optional = help;
  if (help.otherwise.empty()) of_optional.otherwise = "none";
  const double noted = number(key, rule, {}, of_optional);
  return find(key) || record_->present.contains(full(key)) ? std::optional(noted) : std::nullopt;
}

std::int64_t SettingsReader::integer(std::string_view key, std::int64_t min, std::int64_t max,
                                     std::optional<std::int64_t> fallback, const KeyHelp& help) {
  const json* value = value_of(key, fallback.has_value(), help, [&] {
    return KeyNote{.key = {},
                   .type = "integer",
                   .rule = fmt::format("{} to {}", min, max),
                   .otherwise = default_text(fallback),
                   .meaning = {},
                   .example = json(std::clamp<std::int64_t>(1, min, max)).dump(),
                   .words = {}};
  });
  // An unsigned number past the signed range would come out negative: it is refused as too large.
  const bool too_large = value && value->is_number_unsigned() &&
                         value->get<std::uint64_t>() >
                             static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (value && (!value->is_number_integer() || too_large || value->get<std::int64_t>() < min ||
                value->get<std::int64_t>() > max)) {
    refuse(key, fmt::format("must be an integer from {} to {}", min, max));
  }
  const std::int64_t number = value ? value->get<std::int64_t>() : *fallback;
  (*resolved_)[std::string(key)] = number;
  return number;
}

bool SettingsReader::boolean(std::string_view key, std::optional<bool> fallback,
                             const KeyHelp& help) {
  const json* value = value_of(key, fallback.has_value(), help, [&] {
    return KeyNote{.key = {},
                   .type = "true or false",
                   .rule = {},
                   .otherwise = default_text(fallback),
                   .meaning = {},
                   .example = "true",
                   .words = {"false", "true"}};
  });
  if (value && !value->is_boolean()) refuse(key, "must be true or false");
  const bool flag = value ? value->get<bool>() : *fallback;
  (*resolved_)[std::string(key)] = flag;
  return flag;
}

std::string SettingsReader::string(std::string_view key, std::optional<std::string> fallback,
                                   const KeyHelp& help) {
  const json* value = value_of(key, fallback.has_value(), help, [&] {
    return KeyNote{.key = {},
                   .type = "text",
                   .rule = {},
                   .otherwise = default_text(fallback),
                   .meaning = {},
                   .example = json(key).dump(),
                   .words = {}};
  });
  return text_of(key, value, fallback);
}

std::string SettingsReader::text_of(std::string_view key, const json* value,
                                    const std::optional<std::string>& fallback) {
  if (value && !value->is_string()) refuse(key, "must be a string");
  std::string text = value ? value->get<std::string>() : *fallback;
  (*resolved_)[std::string(key)] = text;
  return text;
}

bool SettingsReader::is_word(std::string_view key, std::string_view word, const KeyHelp& help) {
  if (record_) {
    record_->asked.push_back(full(key));
    record_->asked_for_word.emplace_back(full(key), json(word).dump());
  }
  const auto found = table_->find(std::string(key));
  if (found == table_->end() || !found->is_string() || *found != word) return false;
  text_of(key,
          value_of(key, false, help,
                   [&] {
                     return KeyNote{.key = {},
                                    .type = json(word).dump(),
                                    .rule = {},
                                    .otherwise = "none",
                                    .meaning = {},
                                    .example = json(word).dump(),
                                    .words = {}};
                   }),
          {});
  return true;
}

std::string SettingsReader::choice(std::string_view key, const std::vector<std::string_view>& words,
                                   std::optional<std::string> fallback, const KeyHelp& help) {
  std::vector<std::string> quoted;
  if (record_) {
    for (const std::string_view word : words) quoted.push_back(json(word).dump());
  }
  const json* value = value_of(key, fallback.has_value(), help, [&] {
    return KeyNote{.key = {},
                   .type = fmt::format("{}", fmt::join(quoted, " or ")),
                   .rule = {},
                   .otherwise = default_text(fallback),
                   .meaning = {},
                   .example = quoted.front(),
                   .words = quoted};
  });
  std::string word = text_of(key, value, fallback);
  for (const std::string_view allowed : words) {
    if (word == allowed) return word;
  }
  refuse(key, fmt::format("must be one of: {}", fmt::join(words, ", ")));
}

SettingsReader SettingsReader::table(std::string_view key) {
  const json* value = find(key);
  return SettingsReader(value ? *value : empty_object(), full(key), (*resolved_)[std::string(key)],
                        record_);
}

void SettingsReader::finish() const {
  for (const auto& [key, value] : table_->items()) {
    if (asked_.contains(key)) continue;
    throw ConfigError(full(key), shown(value),
                      fmt::format("unknown key; known here: {}", fmt::join(asked_, ", ")));
  }
}

}  // namespace treeroll
