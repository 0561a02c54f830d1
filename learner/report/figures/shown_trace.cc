#include "learner/report/figures/shown_trace.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace treeroll::report {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 15> kUnits = {
    {{"s", "s"},
     {"ms", "ms"},
     {"m", "m"},
     {"mm", "mm"},
     {"kg", "kg"},
     {"n", "N"},
     {"nm", "N m"},
     {"w", "W"},
     {"v", "V"},
     {"a", "A"},
     {"deg", "°"},
     {"rad", "rad"},
     {"radps", "rad/s"},
     {"mps", "m/s"},
     {"mps2", "m/s²"}}};

/// Rows of the first roll-out.
std::size_t rows_on_end(const RolloutTrace& trace) {
  std::size_t row = 1;
  const std::size_t width = trace.columns.size();
  while (row < trace.num_rows() &&
         !(trace.numbers[row * width] < trace.numbers[(row - 1) * width])) {
    ++row;
  }
  return std::min(row, trace.num_rows());
}

}  // namespace

RolloutTrace thinned(const RolloutTrace& trace, std::size_t rows_max) {
  RolloutTrace thin{.columns = trace.columns,
                    .numbers = {},
                    .policy_inputs = trace.policy_inputs,
                    .policy_outputs = trace.policy_outputs,
                    .poses = {}};
  const std::size_t width = trace.columns.size();
  const std::size_t num_rows = rows_on_end(trace);
  const std::size_t num_kept = std::min(num_rows, rows_max);
  for (std::size_t i = 0; i < num_kept; ++i) {
    const std::size_t row = num_kept == 1 ? 0 : i * (num_rows - 1) / (num_kept - 1);
    const auto first = trace.numbers.begin() + static_cast<std::ptrdiff_t>(row * width);
    thin.numbers.insert(thin.numbers.end(), first, first + static_cast<std::ptrdiff_t>(width));
    if (!trace.poses.empty()) thin.poses.push_back(trace.poses[row]);
  }
  return thin;
}

std::optional<std::vector<double>> column_of(const RolloutTrace& trace, const std::string& name) {
  const auto found = std::find(trace.columns.begin(), trace.columns.end(), name);
  if (found == trace.columns.end()) return std::nullopt;
  std::vector<double> values;
  const std::size_t width = trace.columns.size();
  for (auto i = static_cast<std::size_t>(found - trace.columns.begin()); i < trace.numbers.size();
       i += width) {
    values.push_back(trace.numbers[i]);
  }
  return values;
}

std::string goal_of(const std::string& name) { return "goal_" + name; }

std::string axis_title(const std::string& column) {
  const std::size_t last = column.rfind('_');
  std::string title = column;
  std::string unit;
  if (last != std::string::npos) {
    for (const auto& [suffix, symbol] : kUnits) {
      if (column.substr(last + 1) != suffix) continue;
      title = column.substr(0, last);
      unit = " (" + std::string(symbol) + ")";
    }
  }
  std::replace(title.begin(), title.end(), '_', ' ');
  return title + unit;
}

}  // namespace treeroll::report
