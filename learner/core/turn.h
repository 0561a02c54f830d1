#pragma once

#include <string>
#include <string_view>

#include "common/base/log_limiter.h"
#include "common/base/time.h"
#include "learner/core/learner_events.h"

namespace treeroll::learner {

/// One event's moment, and where its effects gather.
struct Turn {
  TimePoint now;
  Effects& effects;
  LogLimiter& limiter;  ///< lines of a kind may come by the thousand, from a flapping network

  void send(protocol::Message message) const;
  /// @param kind  see LogLine
  void log(LogLine::Level level, std::string_view kind, std::string text) const;
  /// Of what was left out: of kinds whose period is over; of all kinds, at the end.
  void log_what_is_due() const;
  void log_the_rest() const;
};

}  // namespace treeroll::learner
