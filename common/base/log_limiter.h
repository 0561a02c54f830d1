#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.h"

namespace treeroll {

/// One line worth a person's time.
struct LogLine {
  enum class Level { kInfo, kWarning, kError };
  Level level = Level::kInfo;
  std::string_view kind;  ///< what may repeat, a literal that outlives all: "workers that leave"
  std::string text;
};

/// Keeps what repeats from filling a log in a run of days. The first kLinesMax lines of a kind
/// pass; further ones within kPeriod are counted and told in one line once the period is over, and
/// so on period by period, until one has passed without any. Pure: time is an argument.
class LogLimiter {
 public:
  static constexpr int kLinesMax = 10;
  static constexpr Duration kPeriod = std::chrono::seconds(60);

  /// Appends the line to `passed`, without control characters (strangers have had a say in it), or
  /// counts it.
  void add(TimePoint now, LogLine line, std::vector<LogLine>& passed);
  /// Appends a line for each kind whose period is over and left lines out. To be called now and
  /// then, whatever happens.
  void tell_due(TimePoint now, std::vector<LogLine>& passed);
  /// The same for all kinds, at the end.
  void tell_rest(TimePoint now, std::vector<LogLine>& passed);

 private:
  struct Kind {
    TimePoint since;  ///< its period's begin
    int num_passed = 0;
    std::int64_t num_left_out = 0;  ///< in this period
    LogLine last;                   ///< of those left out
  };
  static LogLine summary(TimePoint now, const Kind& kind);

  std::map<std::string_view, Kind> kinds_;
};

}  // namespace treeroll
