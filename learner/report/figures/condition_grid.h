#pragma once

#include <string>
#include <vector>

namespace treeroll::report {

/// Conditions that differ in the last part of their names alone: what one panel compares.
struct ConditionGroup {
  std::string name;                     ///< what they share; empty if all are one group
  std::vector<std::string> conditions;  ///< whole names, in the study's order
  std::vector<std::string> labels;      ///< what tells them apart
};

/// The parts of a condition's name: a study of axes joins them by points. A point between digits is
/// a decimal one.
std::vector<std::string> parts_of(const std::string& condition);

/// Groups by all parts but the one at `place` from the end (1: the last), in the study's order.
/// Conditions that have fewer parts stand in the group without a name.
std::vector<ConditionGroup> group(const std::vector<std::string>& conditions, std::size_t place);

}  // namespace treeroll::report
