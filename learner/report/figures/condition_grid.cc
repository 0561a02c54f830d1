#include "learner/report/figures/condition_grid.h"

#include <algorithm>
#include <cctype>

namespace treeroll::report {
namespace {

bool is_digit(const std::string& text, std::size_t place) {
  return place < text.size() && std::isdigit(static_cast<unsigned char>(text[place])) != 0;
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
    const std::vector<std::string> parts = parts_of(condition);
    std::string name;
    std::string label = condition;
    if (parts.size() >= place && parts.size() > 1) {
      const std::size_t varied = parts.size() - place;
      label = parts[varied];
      for (std::size_t i = 0; i < parts.size(); ++i) {
        if (i != varied) name += (name.empty() ? "" : ", ") + parts[i];
      }
    }
    auto found = std::find_if(groups.begin(), groups.end(),
                              [&](const ConditionGroup& known) { return known.name == name; });
    if (found == groups.end()) found = groups.insert(groups.end(), {name, {}, {}});
    found->conditions.push_back(condition);
    found->labels.push_back(label);
  }
  return groups;
}

}  // namespace treeroll::report
