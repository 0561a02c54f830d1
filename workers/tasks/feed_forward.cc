#include "workers/tasks/feed_forward.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/numbers/between.h"

namespace treeroll {

FeedForward::FeedForward(Controller& controller, std::vector<double> times_s, double max)
    : times_s_(std::move(times_s)), outputs_(times_s_.size()) {
  CHECK(!times_s_.empty(), "a time to ask at");
  controller.start();
  controller.act_all(times_s_, outputs_);
  for (double& output : outputs_) output = std::clamp(output, -max, max);
}

double FeedForward::at(double time_s) const {
  if (times_s_.size() == 1) return outputs_[0];
  const auto [after, share] = between(times_s_, time_s);
  return (1 - share) * outputs_[after - 1] + share * outputs_[after];
}

}  // namespace treeroll
