#pragma once

#include <optional>

#include "common/base/time.h"
#include "common/program/log.h"
#include "common/protocol/messages.h"
#include "common/transport/bus.h"
#include "learner/core/pace.h"

namespace treeroll {

/// "188 of 324 roll-outs (58 %), 0 of 2 runs done, best .412; 1 workers with 2 evaluators".
std::string how_far(const protocol::LearnerStatus& status);

/// Turns learner status messages into lines on standard error, fewer the longer it takes: how far
/// the study is, how fast it goes and when it will be done; and why, while nothing moves. On a
/// terminal how far it is stands in one line with a bar, which is there as long as this.
class ProgressLine {
 public:
  /// @param operator_is_here  a person may be asked at this terminal: how far the study is would be
  ///                          written over the question, and is left out there
  explicit ProgressLine(bool operator_is_here);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const protocol::LearnerStatus& status, TimePoint now);
  /// A warning whenever datagrams were refused or could not be sent since the last call.
  void show(const transport::BusStatistics& bus, TimePoint now);

 private:
  std::string pace(std::int64_t num_left) const;

  const bool in_place_;
  const bool is_quiet_;
  std::optional<TimePoint> last_shown_;
  std::optional<TimePoint> last_warned_;
  learner::Pace pace_;
  transport::BusStatistics shown_bus_;
  LimitedLog log_;
};

}  // namespace treeroll
