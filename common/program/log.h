#pragma once

#include <string>
#include <string_view>

#include "common/base/log_limiter.h"
#include "common/base/time.h"

namespace treeroll {

/// Lines go to standard error, with colours for the level where that is a terminal, NO_COLOR is not
/// set and TERM names one that has them.
/// @param name  before each line, with date and process: of daemons that share a terminal; empty:
///              the time of day alone
void log_to_standard_error(const std::string& name);

/// From now on each line is one JSON object, for programs that gather logs:
///   {"time": "2026-11-27T12:00:00.123Z", "level": "warning", "program": "treeroll-learner",
///    "host": "lab7", "pid": 31486, "text": ...}
void log_as_json(const std::string& program);
bool logs_as_json();

void log_line(const LogLine& line);

/// Holds a line at the bottom of a terminal, below what is logged, until the next one; "" removes
/// it. It is cut to the terminal's width.
void show_status_line(std::string_view text);
/// Whether standard error is a terminal that can hold one.
bool has_status_line();

/// What a daemon itself may say again and again (base/log_limiter.h), at its own time.
class LimitedLog {
 public:
  void add(TimePoint now, LogLine::Level level, std::string_view kind, std::string text);
  /// Tells what was left out. To be called now and then.
  void tell_due(TimePoint now);

 private:
  LogLimiter limiter_;
};

}  // namespace treeroll
