#include "common/base/log_limiter.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/for_log.h"

namespace treeroll {

void LogLimiter::add(TimePoint now, LogLine line, std::vector<LogLine>& passed) {
  tell_due(now, passed);
  Kind& kind = kinds_.try_emplace(line.kind, Kind{.since = now, .last = {}}).first->second;
  if (kind.num_passed < kLinesMax) {
    ++kind.num_passed;
    line.text = for_log(line.text);
    passed.push_back(std::move(line));
    return;
  }
  ++kind.num_left_out;
  kind.last = std::move(line);
}

void LogLimiter::tell_due(TimePoint now, std::vector<LogLine>& passed) {
  for (auto entry = kinds_.begin(); entry != kinds_.end();) {
    Kind& kind = entry->second;
    if (now < kind.since + kPeriod) {
      ++entry;
    } else if (kind.num_left_out == 0) {
      entry = kinds_.erase(entry);
    } else {
      passed.push_back(summary(now, kind));
      kind = {.since = now, .num_passed = kLinesMax, .last = {}};
      ++entry;
    }
  }
}

void LogLimiter::tell_rest(TimePoint now, std::vector<LogLine>& passed) {
  for (const auto& [name, kind] : kinds_) {
    if (kind.num_left_out > 0) passed.push_back(summary(now, kind));
  }
  kinds_.clear();
}

LogLine LogLimiter::summary(TimePoint now, const Kind& kind) {
  return {kind.last.level, kind.last.kind,
          fmt::format("{}: {} more in the last {:.0f} s, the last: {}", kind.last.kind,
                      kind.num_left_out, to_seconds(now - kind.since), for_log(kind.last.text))};
}

}  // namespace treeroll
