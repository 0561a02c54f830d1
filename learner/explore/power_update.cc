#include "learner/explore/power_update.h"

#include "common/base/check.h"

namespace treeroll::explore {

std::optional<SearchDistribution> power_update(std::span<const RatedRollout> best,
                                               const Eigen::VectorXd& mean_before,
                                               const Eigen::VectorXd& minimum_noise) {
  CHECK(!best.empty(), "an update needs a roll-out");
  CHECK(minimum_noise.size() == mean_before.size(), "minimum noise and mean differ in size");
  // Rewards enter as shares of the largest: tiny or huge ones neither vanish nor overflow.
  const double largest = best.front().reward;
  if (largest == 0) return std::nullopt;
  double sum = 0;
  for (const RatedRollout& rollout : best) sum += rollout.reward / largest;

  SearchDistribution updated{Eigen::VectorXd::Zero(mean_before.size()),
                             minimum_noise.asDiagonal().toDenseMatrix()};
  for (const RatedRollout& rollout : best) {
    const double weight = rollout.reward / largest / sum;
    const Eigen::VectorXd deviation = rollout.theta - mean_before;
    updated.mean += weight * rollout.theta;
    updated.noise.selfadjointView<Eigen::Lower>().rankUpdate(deviation, weight);
  }
  // Only one half has been summed: the other is its copy, symmetric to the last bit.
  updated.noise.triangularView<Eigen::StrictlyUpper>() = updated.noise.transpose();
  return updated;
}

}  // namespace treeroll::explore
