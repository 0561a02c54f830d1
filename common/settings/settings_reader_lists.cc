#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/number_rule_text.h"
#include "common/settings/settings_reader.h"
#include "common/settings/settings_record.h"

namespace treeroll {
namespace {

std::string size_text(std::size_t min, std::size_t max, const char* what) {
  return min == max ? fmt::format("{} {}", min, what) : fmt::format("{} to {} {}", min, max, what);
}

}  // namespace

std::vector<double> SettingsReader::numbers(std::string_view key, NumberRule rule,
                                            std::size_t min_size, std::size_t max_size,
                                            std::optional<std::vector<double>> fallback,
                                            const KeyHelp& help) {
  const nlohmann::json* value = value_of(key, fallback.has_value(), help, [&] {
    const std::string bounds = bounds_text(rule);
    return KeyNote{
        .key = {},
        .type = help.rule.empty() ? size_text(min_size, max_size, "numbers") : "list of numbers",
        .rule = bounds.empty() ? "" : "each " + bounds,
        .otherwise = default_text(fallback),
        .meaning = {},
        .example = example_numbers(rule, min_size),
        .words = {}};
  });
  std::vector<double> list;
  if (value) {
    if (!value->is_array()) refuse(key, "must be a list of numbers");
    for (const nlohmann::json& element : *value) {
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
    std::size_t size_max, std::optional<std::vector<std::vector<double>>> fallback,
    const KeyHelp& help) {
  const nlohmann::json* value = value_of(key, fallback.has_value(), help, [&] {
    const std::string bounds = bounds_text(rule);
    return KeyNote{.key = {},
                   .type = help.rule.empty() ? fmt::format("1 to {} rows of {}", rows_max,
                                                           size_text(size_min, size_max, "numbers"))
                                             : "rows of numbers",
                   .rule = bounds.empty() ? "" : "each " + bounds,
                   .otherwise = default_text(fallback),
                   .meaning = {},
                   .example = "[" + example_numbers(rule, size_min) + "]",
                   .words = {}};
  });
  std::vector<std::vector<double>> rows;
  if (value) {
    if (!value->is_array() || value->empty()) refuse(key, "must be a list of lists of numbers");
    const bool is_flat = value->front().is_number();
    if (is_flat && size_min > 1) rows.emplace_back();
    for (const nlohmann::json& element : *value) {
      if (element.is_number() != is_flat || !(is_flat || element.is_array())) {
        refuse(key, "must be a list of lists of numbers");
      }
      if (!is_flat || size_min == 1) rows.emplace_back();
      const auto append = [&](const nlohmann::json& number) {
        if (!number.is_number() || !obeys(number.get<double>(), rule)) {
          refuse(key, fmt::format("each number of the lists {}", rule_text(rule)));
        }
        rows.back().push_back(number.get<double>());
      };
      if (is_flat) {
        append(element);
      } else {
        for (const nlohmann::json& number : element) append(number);
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

std::vector<std::string> SettingsReader::strings(std::string_view key, std::size_t size_max,
                                                 const KeyHelp& help) {
  const nlohmann::json* value = value_of(key, false, help, [&] {
    return KeyNote{.key = {},
                   .type = fmt::format("1 to {} strings", size_max),
                   .rule = {},
                   .otherwise = {},
                   .meaning = {},
                   .example = nlohmann::json::array({key}).dump(),
                   .words = {}};
  });
  const std::string rule = fmt::format("must be a list of 1 to {} strings", size_max);
  if (!value->is_array() || value->empty() || value->size() > size_max) refuse(key, rule);
  std::vector<std::string> list;
  for (const nlohmann::json& element : *value) {
    if (!element.is_string()) refuse(key, rule);
    list.push_back(element.get<std::string>());
  }
  (*resolved_)[std::string(key)] = list;
  return list;
}

const nlohmann::json& SettingsReader::list(std::string_view key, std::size_t size_max,
                                           const KeyHelp& help) {
  const nlohmann::json* value = value_of(key, false, help, [&] {
    return KeyNote{.key = {},
                   .type = "list",
                   .rule = fmt::format("1 to {} entries", size_max),
                   .otherwise = {},
                   .meaning = {},
                   .example = "[1]",
                   .words = {}};
  });
  if (!value->is_array() || value->empty()) {
    throw ConfigError(full(key), "", "must be a list that is not empty");
  }
  if (value->size() > size_max) {
    throw ConfigError(full(key), "",
                      fmt::format("holds {} entries: must be at most {}", value->size(), size_max));
  }
  return *value;
}

}  // namespace treeroll
