#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <vector>

namespace treeroll {

/// A roll-out step by step, for people to look at: a table whose columns the task names.
///
///   trace.set_columns({"time_s", "angle_rad", "cart_acceleration_mps2", "cost"});
///   trace.add_row({time_s, angle, input, cost});  // at each step, the start included
class Trace {
 public:
  /// More numbers than this are not kept: is_complete() tells.
  static constexpr std::size_t kNumbersMax = 2'000'000;

  /// Once, before the first row. Names in snake_case, the unit last.
  void set_columns(std::vector<std::string> names);
  /// Precondition: a number for each column. What is not finite is kept as it is.
  void add_row(std::initializer_list<double> numbers);

  /// Empty: the task records no traces.
  const std::vector<std::string>& columns() const { return columns_; }
  /// Row by row, columns().size() numbers each.
  const std::vector<double>& numbers() const { return numbers_; }
  bool is_complete() const { return is_complete_; }

 private:
  std::vector<std::string> columns_;
  std::vector<double> numbers_;
  bool is_complete_ = true;
};

}  // namespace treeroll
