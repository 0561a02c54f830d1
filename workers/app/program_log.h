#pragma once

#include <cstdint>
#include <string>

#include "common/base/time.h"

namespace treeroll::worker {

/// What a user's program says, line by line, as far as a log has room: a program that prints in
/// each step of its simulation must fill no disk. Pure: time is an argument.
class LineBudget {
 public:
  static constexpr int kLinesPerSecond = 50;

  /// Whether another line passes; else it is counted.
  bool allows(TimePoint now);
  /// Lines that did not pass since this was asked last. To be asked before a line that passes.
  std::int64_t take_left_out();

 private:
  TimePoint since_{};
  int num_passed_ = kLinesPerSecond;
  std::int64_t num_left_out_ = 0;
};

/// Logs a line of a user's program, or counts it.
class ProgramLog {
 public:
  void operator()(const std::string& where, const std::string& line);

 private:
  LineBudget budget_;
};

}  // namespace treeroll::worker
