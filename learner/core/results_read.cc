#include "learner/core/results_read.h"

#include <algorithm>
#include <iterator>

#include "common/base/check.h"
#include "common/protocol/limits.h"

namespace treeroll::learner {

void ResultsRead::note(std::int64_t first, std::int64_t last) {
  CHECK(first <= last, "a stretch ends before it begins");
  if (first <= last_without_gap_ + 1) {
    last_without_gap_ = std::max(last_without_gap_, last);
    return close_gaps();
  }
  // Those that it overlaps or touches become one with it.
  auto place = stretches_.upper_bound(first);
  if (place != stretches_.begin() && std::prev(place)->second >= first - 1) --place;
  while (place != stretches_.end() && place->first <= last + 1) {
    first = std::min(first, place->first);
    last = std::max(last, place->second);
    place = stretches_.erase(place);
  }
  stretches_.emplace(first, last);
  if (stretches_.size() > protocol::kStretchesReadMax)
    stretches_.erase(std::prev(stretches_.end()));
}

void ResultsRead::forget_before(std::int64_t oldest) {
  last_without_gap_ = std::max(last_without_gap_, oldest - 1);
  close_gaps();
}

bool ResultsRead::contains(std::int64_t index) const {
  if (index <= last_without_gap_) return true;
  const auto after = stretches_.upper_bound(index);
  return after != stretches_.begin() && std::prev(after)->second >= index;
}

void ResultsRead::close_gaps() {
  while (!stretches_.empty() && stretches_.begin()->first <= last_without_gap_ + 1) {
    last_without_gap_ = std::max(last_without_gap_, stretches_.begin()->second);
    stretches_.erase(stretches_.begin());
  }
}

}  // namespace treeroll::learner
