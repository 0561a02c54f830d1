#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/log_limiter.h"
#include "common/base/time.h"

namespace treeroll {

/// One step of a pure core: when it is, and where its effects go. A core hands it down to whatever
/// decides for it in that step.
/// @tparam Effect  the core's variant of effects; LogLine is one of them
template <class Effect>
struct Turn {
  TimePoint now;
  std::vector<Effect>& effects;
  LogLimiter& limiter;

  /// Unless there are too many of its kind.
  void write(LogLine line) const {
    std::vector<LogLine> lines;
    limiter.add(now, std::move(line), lines);
    pass_on(lines);
  }
  void inform(std::string_view kind, std::string text) const {
    write({LogLine::Level::kInfo, kind, std::move(text)});
  }
  void warn(std::string_view kind, std::string text) const {
    write({LogLine::Level::kWarning, kind, std::move(text)});
  }
  /// What was left out, of the periods that are over; to be called now and then.
  void log_due() const {
    std::vector<LogLine> lines;
    limiter.tell_due(now, lines);
    pass_on(lines);
  }
  /// The same of all periods, at the end.
  void log_rest() const {
    std::vector<LogLine> lines;
    limiter.tell_rest(now, lines);
    pass_on(lines);
  }

 private:
  void pass_on(std::vector<LogLine>& lines) const {
    for (LogLine& line : lines) effects.emplace_back(std::move(line));
  }
};

}  // namespace treeroll
