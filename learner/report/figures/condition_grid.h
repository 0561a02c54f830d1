#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "learner/report/figures/plot.h"

namespace treeroll::report {

/// Conditions that differ in one part of their names alone: what one panel compares.
struct ConditionGroup {
  std::string name;  ///< what they share; empty if all are one group
  std::string row;   ///< the same without its last part: panels beside each other
  std::vector<std::string> conditions;  ///< whole names, in the study's order
  std::vector<std::string> labels;      ///< what tells them apart
};

/// The parts of a condition's name: a study of axes joins them by points. A point between digits is
/// a decimal one.
std::vector<std::string> parts_of(const std::string& condition);

/// Groups by all parts but the one at `place` from the end (1: the last), in the study's order.
/// Conditions that have fewer parts stand in the group without a name.
std::vector<ConditionGroup> group(const std::vector<std::string>& conditions, std::size_t place);

/// The most parts that a name has: places to group by.
std::size_t num_places(const std::vector<std::string>& conditions);

/// Every two conditions of a group, whatever the place: those that a study's axes set against each
/// other. By place from the last part on, each pair once.
std::vector<std::pair<std::string, std::string>> pairs_of(
    const std::vector<std::string>& conditions);

/// What items say is their row, one row after the other, in the order given.
template <class T, class RowOf>
Rows<T> rows_by(const std::vector<T>& items, const RowOf& row_of) {
  Rows<T> rows;
  std::vector<std::string> names;
  for (const T& item : items) {
    const std::string name = row_of(item);
    const auto known = std::find(names.begin(), names.end(), name);
    const auto place = static_cast<std::size_t>(known - names.begin());
    if (known == names.end()) {
      names.push_back(name);
      rows.emplace_back();
    }
    rows[place].push_back(item);
  }
  return rows;
}

/// All parts of a condition's name but the last: the row of its panel.
std::string shared_parts(const std::string& condition);

}  // namespace treeroll::report
