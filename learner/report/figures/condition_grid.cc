#include "learner/report/figures/condition_grid.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>

namespace treeroll::report {
namespace {

bool is_digit(const std::string& text, std::size_t place) {
  return place < text.size() && std::isdigit(static_cast<unsigned char>(text[place])) != 0;
}

/// The first parts.
std::string joined(const std::vector<std::string>& parts, std::size_t count) {
  return fmt::format(
      "{}", fmt::join(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(count), ", "));
}

}  // namespace

std::vector<std::string> parts_of(const std::string& condition) {
  std::vector<std::string> parts(1);
  for (std::size_t i = 0; i < condition.size(); ++i) {
    const bool is_decimal = i > 0 && is_digit(condition, i - 1) && is_digit(condition, i + 1);
    if (condition[i] == '.' && !is_decimal) {
      parts.emplace_back();
    } else {
      parts.back() += condition[i];
    }
  }
  return parts;
}

std::vector<ConditionGroup> group(const std::vector<std::string>& conditions, std::size_t place) {
  std::vector<ConditionGroup> groups;
  for (const std::string& condition : conditions) {
    std::vector<std::string> parts = parts_of(condition);
    std::string label = condition;
    if (parts.size() >= place && parts.size() > 1) {
      const auto varied = parts.end() - static_cast<std::ptrdiff_t>(place);
      label = *varied;
      parts.erase(varied);
    } else {
      parts.clear();
    }
    const std::string name = joined(parts, parts.size());
    auto found = std::find_if(groups.begin(), groups.end(),
                              [&](const ConditionGroup& known) { return known.name == name; });
    if (found == groups.end()) {
      const std::string row = joined(parts, parts.empty() ? 0 : parts.size() - 1);
      found =
          groups.insert(groups.end(), {.name = name, .row = row, .conditions = {}, .labels = {}});
    }
    found->conditions.push_back(condition);
    found->labels.push_back(label);
  }
  return groups;
}

std::size_t num_places(const std::vector<std::string>& conditions) {
  std::size_t most = 0;
  for (const std::string& condition : conditions) most = std::max(most, parts_of(condition).size());
  return most;
}

std::vector<std::pair<std::string, std::string>> pairs_of(
    const std::vector<std::string>& conditions) {
  std::vector<std::pair<std::string, std::string>> pairs;
  std::set<std::pair<std::string, std::string>> known;
  for (std::size_t place = 1; place <= num_places(conditions); ++place) {
    for (const ConditionGroup& together : group(conditions, place)) {
      const auto& names = together.conditions;
      for (std::size_t i = 0; i < names.size(); ++i) {
        for (std::size_t j = i + 1; j < names.size(); ++j) {
          const std::pair pair(names[i], names[j]);
          if (known.insert(pair).second) pairs.push_back(pair);
        }
      }
    }
  }
  return pairs;
}

std::string shared_parts(const std::string& condition) {
  const std::vector<std::string> parts = parts_of(condition);
  return joined(parts, parts.size() - 1);
}

}  // namespace treeroll::report
