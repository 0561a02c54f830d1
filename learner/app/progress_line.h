#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/log_limiter.h"
#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "common/transport/bus.h"
#include "learner/core/pace.h"

namespace treeroll {

/// Turns learner status messages into lines on standard error, fewer the longer it takes: how far
/// the study is, how fast it goes and when it will be done; and why, while nothing moves.
class ProgressLine {
 public:
  void show(const protocol::LearnerStatus& status, TimePoint now);
  /// A warning whenever datagrams were refused or could not be sent since the last call.
  void show(const transport::BusStatistics& bus, TimePoint now);

 private:
  std::string pace(std::int64_t num_left) const;
  void warn(TimePoint now, std::string_view kind, std::string text);

  std::optional<TimePoint> last_shown_;
  std::optional<TimePoint> last_warned_;
  learner::Pace pace_;
  transport::BusStatistics shown_bus_;
  LogLimiter limiter_;
};

}  // namespace treeroll
