#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include "common/base/time.h"

namespace treeroll::simulation {

/// Virtual time: what is to happen, in the order of its time, then of its scheduling.
class Schedule {
 public:
  using Action = std::function<void()>;

  TimePoint now() const { return now_; }

  /// A time that has passed is now.
  void at(TimePoint time, Action action) {
    actions_.emplace(std::pair(std::max(time, now_), next_++), std::move(action));
  }
  void after(Duration delay, Action action) { at(now_ + delay, std::move(action)); }

  /// Does the next thing. False, and nothing happens, if there is none up to `end`.
  bool advance(TimePoint end) {
    if (actions_.empty() || actions_.begin()->first.first > end) return false;
    const auto first = actions_.extract(actions_.begin());
    now_ = first.key().first;
    first.mapped()();
    return true;
  }

 private:
  std::map<std::pair<TimePoint, std::uint64_t>, Action> actions_;
  std::uint64_t next_ = 0;
  TimePoint now_{};
};

}  // namespace treeroll::simulation
