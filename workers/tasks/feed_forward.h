#pragma once

#include <vector>

#include "common/policy/controller.h"

namespace treeroll {

/// What a controller of time gives over a roll-out, asked for once and in the order of time, as a
/// controller with a state of its own wants it. Between those times it goes straight.
class FeedForward {
 public:
  /// @param times_s  each above the one before, not empty
  /// @param max      of its absolute value: more is cut
  FeedForward(Controller& controller, std::vector<double> times_s, double max);
  /// At one of the times, to the bit what the controller gave; before and after them that of the
  /// first and the last.
  double at(double time_s) const;

 private:
  std::vector<double> times_s_;
  std::vector<double> outputs_;
};

}  // namespace treeroll
