#pragma once

#include <chrono>
#include <cstdint>

namespace treeroll {

/// Time as the cores see it: given to them with each event, never read. It has no now(), so a core
/// cannot ask; daemons pass a monotonic clock, tests and replay pass what they like.
struct EventClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<EventClock>;
  static constexpr bool is_steady = true;
};

using Duration = EventClock::duration;
using TimePoint = EventClock::time_point;

inline double to_seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace treeroll
