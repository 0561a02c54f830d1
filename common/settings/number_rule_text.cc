#include "common/settings/number_rule_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace treeroll {
namespace {

template <typename T>
std::string as_json(const std::optional<T>& value) {
  return value ? nlohmann::json(*value).dump() : "";
}

}  // namespace

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

std::string bounds_text(NumberRule rule) {
  const bool has_min = rule.min != kAnyNumber.min;
  const bool has_max = rule.max != kAnyNumber.max;
  const std::string above = rule.min_allowed ? "" : "above ";
  if (has_min && has_max) return fmt::format("{}{} to {}", above, rule.min, rule.max);
  if (has_min) return fmt::format("{} {}", rule.min_allowed ? "at least" : "above", rule.min);
  return has_max ? fmt::format("at most {}", rule.max) : "";
}

std::string example_number(NumberRule rule) {
  return nlohmann::json(std::clamp(1., rule.min, rule.max)).dump();
}

std::string example_numbers(NumberRule rule, std::size_t count) {
  nlohmann::json numbers = nlohmann::json::array();
  for (std::size_t i = 1; i <= count; ++i) {
    numbers.push_back(std::clamp(static_cast<double>(i), rule.min, rule.max));
  }
  return numbers.dump();
}

std::string default_text(const std::optional<double>& fallback) { return as_json(fallback); }
std::string default_text(const std::optional<std::int64_t>& fallback) { return as_json(fallback); }
std::string default_text(const std::optional<bool>& fallback) { return as_json(fallback); }
std::string default_text(const std::optional<std::string>& fallback) { return as_json(fallback); }
std::string default_text(const std::optional<std::vector<double>>& fallback) {
  return as_json(fallback);
}
std::string default_text(const std::optional<std::vector<std::vector<double>>>& fallback) {
  return as_json(fallback);
}

}  // namespace treeroll
