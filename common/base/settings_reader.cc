#include "common/base/settings_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/config_error.h"

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

std::string rule_text(NumberRule rule) {
  const bool has_min = rule.min != kAnyNumber.min;
  const bool has_max = rule.max != kAnyNumber.max;
  std::string text = "must be a finite number";
  if (has_min) text += fmt::format(" {} {}", rule.min_allowed ? "of at least" : "above", rule.min);
  if (has_max) text += fmt::format("{} at most {}", has_min ? " and" : " of", rule.max);
  return text;
}

bool obeys(double number, NumberRule rule) {
  return std::isfinite(number) && number <= rule.max &&
         (rule.min_allowed ? number >= rule.min : number > rule.min);
}

}  // namespace

SettingsReader::SettingsReader(const json& table, std::string path, json& resolved)
    : table_(&table), path_(std::move(path)), resolved_(&resolved) {
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
  return table_->find(std::string(key)) != table_->end();
}

void SettingsReader::require(std::string_view key, bool has_fallback) const {
  if (!has_fallback) throw ConfigError(full(key), "", "is required and missing");
}

void SettingsReader::refuse(std::string_view key, const std::string& rule) const {
  const auto found = table_->find(std::string(key));
  throw ConfigError(full(key), found == table_->end() ? "" : shown(*found), rule);
}

double SettingsReader::number(std::string_view key, NumberRule rule,
                              std::optional<double> fallback) {
  const json* value = find(key);
  if (!value) require(key, fallback.has_value());
  if (value && (!value->is_number() || !obeys(value->get<double>(), rule))) {
    refuse(key, rule_text(rule));
  }
  const double number = value ? value->get<double>() : *fallback;
  (*resolved_)[std::string(key)] = number;
  return number;
}

std::optional<double> SettingsReader::optional_number(std::string_view key, NumberRule rule) {
  return find(key) ? std::optional(number(key, rule)) : std::nullopt;
}

std::int64_t SettingsReader::integer(std::string_view key, std::int64_t min, std::int64_t max,
                                     std::optional<std::int64_t> fallback) {
  const json* value = find(key);
  if (!value) require(key, fallback.has_value());
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

bool SettingsReader::boolean(std::string_view key, std::optional<bool> fallback) {
  const json* value = find(key);
  if (!value) require(key, fallback.has_value());
  if (value && !value->is_boolean()) refuse(key, "must be true or false");
  const bool flag = value ? value->get<bool>() : *fallback;
  (*resolved_)[std::string(key)] = flag;
  return flag;
}

std::string SettingsReader::string(std::string_view key, std::optional<std::string> fallback) {
  const json* value = find(key);
  if (!value) require(key, fallback.has_value());
  if (value && !value->is_string()) refuse(key, "must be a string");
  std::string text = value ? value->get<std::string>() : *fallback;
  (*resolved_)[std::string(key)] = text;
  return text;
}

bool SettingsReader::is_word(std::string_view key, std::string_view word) {
  const auto found = table_->find(std::string(key));
  if (found == table_->end() || !found->is_string() || *found != word) return false;
  string(key);
  return true;
}

std::string SettingsReader::choice(std::string_view key, const std::vector<std::string_view>& words,
                                   std::optional<std::string> fallback) {
  std::string word = string(key, std::move(fallback));
  for (const std::string_view allowed : words) {
    if (word == allowed) return word;
  }
  refuse(key, fmt::format("must be one of: {}", fmt::join(words, ", ")));
}

std::vector<double> SettingsReader::numbers(std::string_view key, NumberRule rule,
                                            std::size_t min_size, std::size_t max_size,
                                            std::optional<std::vector<double>> fallback) {
  const json* value = find(key);
  if (!value) require(key, fallback.has_value());
  std::vector<double> list;
  if (value) {
    if (!value->is_array()) refuse(key, "must be a list of numbers");
    for (const json& element : *value) {
      if (!element.is_number() || !obeys(element.get<double>(), rule)) {
        refuse(key, fmt::format("each number of the list {}", rule_text(rule)));
      }
      list.push_back(element.get<double>());
    }
  } else {
    list = *fallback;
  }
  if (list.size() < min_size || list.size() > max_size) {
    refuse(key, min_size == max_size
                    ? fmt::format("must hold {} numbers", min_size)
                    : fmt::format("must hold from {} to {} numbers", min_size, max_size));
  }
  (*resolved_)[std::string(key)] = list;
  return list;
}

std::vector<std::vector<double>> SettingsReader::rows(
    std::string_view key, NumberRule rule, std::size_t rows_max, std::size_t size_min,
    std::size_t size_max, std::optional<std::vector<std::vector<double>>> fallback) {
  const json* value = find(key);
  if (!value) require(key, fallback.has_value());
  std::vector<std::vector<double>> rows;
  if (value) {
    if (!value->is_array() || value->empty()) refuse(key, "must be a list of lists of numbers");
    const bool is_flat = value->front().is_number();
    if (is_flat && size_min > 1) rows.emplace_back();
    for (const json& element : *value) {
      if (element.is_number() != is_flat || !(is_flat || element.is_array())) {
        refuse(key, "must be a list of lists of numbers");
      }
      if (!is_flat || size_min == 1) rows.emplace_back();
      const auto append = [&](const json& number) {
        if (!number.is_number() || !obeys(number.get<double>(), rule)) {
          refuse(key, fmt::format("each number of the lists {}", rule_text(rule)));
        }
        rows.back().push_back(number.get<double>());
      };
      if (is_flat) {
        append(element);
      } else {
        for (const json& number : element) append(number);
      }
    }
  } else {
    rows = *fallback;
  }
  if (rows.size() > rows_max) refuse(key, fmt::format("must hold at most {} lists", rows_max));
  for (const std::vector<double>& row : rows) {
    if (row.size() < size_min || row.size() > size_max) {
      refuse(key, size_min == size_max ? fmt::format("each list must hold {} numbers", size_min)
                                       : fmt::format("each list must hold from {} to {} numbers",
                                                     size_min, size_max));
    }
    if (row.size() != rows[0].size()) refuse(key, "all lists must be equally long");
  }
  (*resolved_)[std::string(key)] = rows;
  return rows;
}

std::vector<std::string> SettingsReader::strings(std::string_view key, std::size_t size_max) {
  const json* value = find(key);
  if (!value) require(key, false);
  const std::string rule = fmt::format("must be a list of 1 to {} strings", size_max);
  if (!value->is_array() || value->empty() || value->size() > size_max) refuse(key, rule);
  std::vector<std::string> list;
  for (const json& element : *value) {
    if (!element.is_string()) refuse(key, rule);
    list.push_back(element.get<std::string>());
  }
  (*resolved_)[std::string(key)] = list;
  return list;
}

SettingsReader SettingsReader::table(std::string_view key) {
  const json* value = find(key);
  return SettingsReader(value ? *value : empty_object(), full(key), (*resolved_)[std::string(key)]);
}

void SettingsReader::finish() const {
  for (const auto& [key, value] : table_->items()) {
    if (asked_.contains(key)) continue;
    throw ConfigError(full(key), shown(value),
                      fmt::format("unknown key; known here: {}", fmt::join(asked_, ", ")));
  }
}

}  // namespace treeroll
