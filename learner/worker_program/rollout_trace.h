#pragma once

#include <string>
#include <vector>

namespace treeroll {

/// A roll-out step by step as a worker has recorded it (workers/tasks/trace.h): a table, and what
/// would be seen at each of its rows. All of it is the task's own; the learner gives it no meaning.
struct RolloutTrace {
  std::vector<std::string> columns;         ///< the first is what the others are drawn over
  std::vector<double> numbers;              ///< row by row; NaN for those that are not finite
  std::vector<std::string> policy_inputs;   ///< columns, in the policy's order; may be empty
  std::vector<std::string> policy_outputs;  ///< columns, in the policy's order; may be empty
  /// By row, or empty: lines, each x, y, x, y, ... in m, y upwards.
  std::vector<std::vector<std::vector<double>>> poses;

  std::size_t num_rows() const { return columns.empty() ? 0 : numbers.size() / columns.size(); }
};

}  // namespace treeroll
