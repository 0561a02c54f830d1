#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "common/base/time.h"

namespace treeroll::worker {

/// What a user's program says, line by line, as far as a log has room: a program that prints in
/// each step of its simulation must fill no disk in days. Pure: time is an argument.
class LineBudget {
 public:
  static constexpr int kLinesAtOnce = 500;
  /// Once these are used up, between two lines of all evaluators of a worker.
  static constexpr Duration kPause = std::chrono::seconds(1);

  explicit LineBudget(int num_evaluators) : pause_(num_evaluators * kPause) {}

  /// Whether another line passes; else it is counted.
  bool allows(TimePoint now);
  /// Lines that did not pass since this was asked last. To be asked before a line that passes.
  std::int64_t take_left_out();

 private:
  Duration pause_;
  TimePoint since_{};  ///< the lines gained until then are in num_left_
  std::int64_t num_left_ = kLinesAtOnce;
  std::int64_t num_left_out_ = 0;
};

/// Logs a line of a user's program, or counts it.
class ProgramLog {
 public:
  /// @param num_evaluators  that share the log
  explicit ProgramLog(int num_evaluators) : budget_(num_evaluators) {}
  void operator()(const std::string& where, const std::string& line);

 private:
  LineBudget budget_;
};

}  // namespace treeroll::worker
