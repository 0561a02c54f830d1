#include "learner/core/pace.h"

#include <algorithm>

namespace treeroll::learner {
namespace {

constexpr Duration kStretchMin = std::chrono::seconds(2);
constexpr std::int64_t kNumDoneMin = 5;
/// A stretch that takes so many times longer than expected counts though it brings too few.
constexpr double kSlower = 3;
constexpr double kWeight = .3;

}  // namespace

void Pace::note(TimePoint now, std::int64_t num_done, int num_evaluators) {
  if (!since_) {
    since_ = {now, num_done};
    return;
  }
  const Duration stretch = now - since_->time;
  if (stretch < kStretchMin) return;
  const auto come = static_cast<double>(num_done - since_->num_done);
  const auto enough = static_cast<double>(std::max<std::int64_t>(kNumDoneMin, num_evaluators));
  const bool slower = per_s_ && to_seconds(stretch) * *per_s_ > kSlower * enough;
  if (come < enough && !slower) return;
  const double per_s = come / to_seconds(stretch);
  per_s_ = per_s_ ? *per_s_ + kWeight * (per_s - *per_s_) : per_s;
  since_ = {now, num_done};
}

}  // namespace treeroll::learner
