#pragma once

#include <cstddef>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace treeroll {

/// A point of what is seen, in a plane: x to the right, y upwards, in m.
struct PosePoint {
  double x_m = 0;
  double y_m = 0;
};

/// What is seen at one instant: lines through points.
using Pose = std::vector<std::vector<PosePoint>>;

/// A roll-out step by step, for people to look at: a table whose columns the task names, and, if
/// the task likes, what would be seen of it.
///
///   trace.set_columns({"time_s", "angle_rad", "cart_acceleration_mps2", "cost"});
///   trace.set_policy_columns({"time_s"}, {"cart_acceleration_mps2"});
///   trace.add_row({time_s, angle, input, cost});  // at each step, the start included
///   trace.add_pose({{{0, 0}, {-elementary::sin(angle), elementary::cos(angle)}}});
///   trace.set_term("effort", effort);  // at the end
class Trace {
 public:
  /// Where only terms are asked for, rows and poses are dropped.
  enum class Kept { kAll, kTerms };
  explicit Trace(Kept kept = Kept::kAll) : kept_(kept) {}

  /// More numbers than this, those of poses included, are not kept: is_complete() tells.
  static constexpr std::size_t kNumbersMax = 2'000'000;

  /// Once, before the first row. Names in snake_case, the unit last; the first is what the others
  /// are drawn over. A column goal_NAME says what column NAME ought to be.
  void set_columns(std::vector<std::string> names);
  /// Which columns are the policy's inputs and outputs, in its order: pictures of policies take
  /// their axes and goals from them. Precondition: columns there are.
  void set_policy_columns(std::vector<std::string> inputs, std::vector<std::string> outputs);
  /// Precondition: a number for each column. What is not finite is kept as it is.
  void add_row(std::initializer_list<double> numbers);
  void add_row(std::span<const double> numbers);
  /// Of the row before. Precondition: every row has one, or none has.
  void add_pose(Pose pose);

  /// What the reward is made of, by name: for people, learning goes by the reward alone. A name
  /// that was given before gets the new number.
  /// Throws std::invalid_argument for a name that is empty or has more than kTermNameBytesMax
  /// bytes, and for more names than kTermsMax.
  void set_term(const std::string& name, double number);
  static constexpr std::size_t kTermsMax = 64;
  static constexpr std::size_t kTermNameBytesMax = 64;

  bool keeps_rows() const { return kept_ == Kept::kAll; }
  const std::map<std::string, double>& terms() const { return terms_; }
  /// Empty: the task records no traces.
  const std::vector<std::string>& columns() const { return columns_; }
  /// Row by row, columns().size() numbers each.
  const std::vector<double>& numbers() const { return numbers_; }
  const std::vector<std::string>& policy_inputs() const { return policy_inputs_; }
  const std::vector<std::string>& policy_outputs() const { return policy_outputs_; }
  /// By row, or empty.
  const std::vector<Pose>& poses() const { return poses_; }
  bool is_complete() const { return is_complete_; }

 private:
  bool has_room_for(std::size_t num_numbers);

  Kept kept_;
  std::map<std::string, double> terms_;
  std::vector<std::string> columns_;
  std::vector<std::string> policy_inputs_;
  std::vector<std::string> policy_outputs_;
  std::vector<double> numbers_;
  std::vector<Pose> poses_;
  std::size_t num_kept_ = 0;
  bool is_complete_ = true;
};

}  // namespace treeroll
