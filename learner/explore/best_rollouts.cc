#include "learner/explore/best_rollouts.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace treeroll::explore {

bool ranks_before(const RatedRollout& a, const RatedRollout& b) {
  return a.reward != b.reward ? a.reward > b.reward : a.rollout < b.rollout;
}

BestRollouts::BestRollouts(int capacity) : capacity_(static_cast<std::size_t>(capacity)) {
  CHECK(capacity >= 1, "at least one roll-out is considered");
}

void BestRollouts::add(RatedRollout rollout) {
  if (ranked_.size() == capacity_) {
    if (!ranks_before(rollout, ranked_.back())) return;
    ranked_.pop_back();
  }
  const auto place = std::upper_bound(ranked_.begin(), ranked_.end(), rollout, ranks_before);
  ranked_.insert(place, std::move(rollout));
}

}  // namespace treeroll::explore
