#pragma once

#include <algorithm>

#include "common/base/time.h"

namespace treeroll::web {

/// How much of a thread's time something may take: a share of it, and a little at once. Who works
/// notes what it has used; who wants to work asks when. Pure: time and what was used are arguments.
///
///   TimeShare share({.share = 0.05, .at_once = 50ms});
///   if (share.next(now) <= now) share.use(now, work());
class TimeShare {
 public:
  struct Limit {
    double share = 1;
    Duration at_once{};
  };
  explicit TimeShare(Limit limit) : limit_(limit), left_(limit.at_once) {}

  /// From then on there is time to work.
  TimePoint next(TimePoint now) {
    gain(now);
    if (left_ >= Duration::zero()) return now;
    return now + Duration(static_cast<Duration::rep>(
                     static_cast<double>(-left_.count()) / limit_.share + 1));
  }
  void use(TimePoint now, Duration used) {
    gain(now);
    left_ -= used;
  }

 private:
  void gain(TimePoint now) {
    if (gained_at_ == TimePoint{}) gained_at_ = now;
    const auto gained = static_cast<double>((now - gained_at_).count()) * limit_.share;
    left_ = std::min(limit_.at_once, left_ + Duration(static_cast<Duration::rep>(gained)));
    gained_at_ = now;
  }

  Limit limit_;
  Duration left_;
  TimePoint gained_at_{};
};

}  // namespace treeroll::web
