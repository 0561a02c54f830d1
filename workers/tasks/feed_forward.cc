#include "workers/tasks/feed_forward.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "common/base/check.h"

namespace treeroll {

FeedForward::FeedForward(Controller& controller, std::vector<double> times_s, double max)
    : times_s_(std::move(times_s)), outputs_(times_s_.size()) {
  CHECK(!times_s_.empty(), "a time to ask at");
  controller.start();
  controller.act_all(times_s_, outputs_);
  for (double& output : outputs_) output = std::clamp(output, -max, max);
}

double FeedForward::at(double time_s) const {
  const auto after = std::lower_bound(times_s_.begin(), times_s_.end(), time_s);
  if (after == times_s_.end()) return outputs_.back();
  const auto i = static_cast<std::size_t>(after - times_s_.begin());
  if (i == 0 || *after == time_s) return outputs_[i];
  const double share = (time_s - times_s_[i - 1]) / (times_s_[i] - times_s_[i - 1]);
  return (1 - share) * outputs_[i - 1] + share * outputs_[i];
}

}  // namespace treeroll
