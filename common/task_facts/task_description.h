#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/base/signal_names.h"

namespace treeroll {

inline constexpr int kTaskDimMax = kSignalsMax;    ///< inputs or outputs of a task
inline constexpr double kTaskTimeLimitSMax = 1e6;  ///< what a clock in nanoseconds can count
inline constexpr std::size_t kTaskVersionBytesMax = 128;
/// Of what a worker reports of a task: one message of the smallest frame holds it.
inline constexpr std::size_t kTaskReportBytesMax = 1024;

/// What a task says of itself before any roll-out. A task states it, a worker reports it, and the
/// learner, which knows no task, goes by it.
struct TaskDescription {
  int input_dim = 0;      ///< dI of the policies it executes
  int output_dim = 0;     ///< dO
  double reward_min = 0;  ///< rewards are finite and within [reward_min, reward_max]; min >= 0
  double reward_max = 1;
  /// Positive: CPU time after which an evaluation hangs. One that burns next to none, because it
  /// sleeps or waits for another process, hangs after 1.5 to 2 times as much wall time and a
  /// second.
  double time_limit_s = 0;
  bool deterministic = true;  ///< the same policy gives the same reward, whatever the seed
  /// Starting a roll-out once more while it is under way elsewhere does no harm. False for what
  /// moves a real robot: idle evaluators are then not given what is late at others.
  bool repeatable = true;
  /// Of the task's code, as its author counts: one that changes rewards gets another. Study and
  /// workers must agree on it. Empty: it states none.
  std::string version = {};
  /// Of inputs and outputs, input_dim and output_dim of them; empty: it names none.
  SignalNames signals = {};

  /// False for what is no number, too.
  bool is_in_range(double reward) const { return reward >= reward_min && reward <= reward_max; }
  bool operator==(const TaskDescription&) const = default;
};

/// An object with the names of TaskDescription's members, `repeatable` only where it is false and
/// `version` only if there is one: what the content of a resolved task holds. Signals are not in
/// it: names are no part of what a task is.
nlohmann::json to_json(const TaskDescription& description);
/// The same with `inputs` and `outputs`, lists of names, if there are any: what --describe-task
/// prints and a study keeps.
nlohmann::json to_json_with_signals(const TaskDescription& description);
/// The same as text, as a worker reports it of a task that it accepts: without the names where they
/// would take it past kTaskReportBytesMax.
std::string report_text(const TaskDescription& description);

/// Reads such an object from outside: all members present but `repeatable`, true by default,
/// `version`, `inputs` and `outputs`, of their type and within their bounds, and no others.
Result<TaskDescription> task_description_from_json(std::string_view text);

}  // namespace treeroll
