#pragma once

#include "common/settings/settings_reader.h"
#include "sim/cart_pendulum.h"

namespace treeroll {

/// When a double pendulum counts as held: both angles stay within angle_max_rad of the target from
/// after_s to until_s, at each output step of the plant.
struct HoldingRule {
  double after_s = 1.5;  ///< what has been caught may swing out until then
  double until_s = 5;
  double angle_max_rad = .2;
};

/// Reads after_s and angle_max_rad of the table `holds` of a task, and no other key of it.
/// @param until_s  the end of what is held. Throws ConfigError, also where after_s is not below it.
HoldingRule read_holding_rule(SettingsReader& table, double until_s);

/// Sees a roll-out step by step.
class Holding {
 public:
  explicit Holding(const HoldingRule& rule) : rule_(rule) {}
  /// @param time_s  ascending, from the instant that the rule counts from; may be negative
  /// @param state   angles from the target
  void see(double time_s, const sim::CartPendulumState& state);
  /// So far: false before after_s. After until_s, the verdict.
  bool holds() const { return is_seen_ && !has_fallen_; }

 private:
  HoldingRule rule_;
  bool is_seen_ = false;
  bool has_fallen_ = false;
};

}  // namespace treeroll
