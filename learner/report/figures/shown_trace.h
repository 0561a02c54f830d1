#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "learner/worker_program/rollout_trace.h"

namespace treeroll::report {

/// A roll-out that was made to be looked at.
struct ShownRollout {
  double reward = 0;
  std::string status = "ok";
  RolloutTrace trace;
  std::map<std::string, double> terms = {};  ///< of its reward
};

/// As much of a trace as a picture shows: at most `rows_max` rows, equally spaced, its first and
/// last among them; of several roll-outs on end (the first column falls back) the first.
RolloutTrace thinned(const RolloutTrace& trace, std::size_t rows_max);

/// The numbers of a column; nothing if there is none of this name.
std::optional<std::vector<double>> column_of(const RolloutTrace& trace, const std::string& name);

/// What column `name` ought to be, if the task says it: column goal_NAME.
std::string goal_of(const std::string& name);

/// A column's name for an axis: "cart_acceleration_mps2" is "cart acceleration (m/s²)". A last part
/// that is no unit known here stays a word.
std::string axis_title(const std::string& column);

}  // namespace treeroll::report
