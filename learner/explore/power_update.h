#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "learner/explore/best_rollouts.h"
#include "learner/explore/search_distribution.h"

namespace treeroll::explore {

/// Black-box PoWER, thesis (3-14) and (3-15):
///
///   mean  <- sum_i r_i theta~_i / sum_i r_i
///   noise <- sum_i r_i (theta~_i - mean_before)(theta~_i - mean_before)^T / sum_i r_i + S_min
///
/// The print of (3-15) lacks the mean, the normalisation and the transposition.
/// @param best           w(1) .. w(I): the best roll-outs of this layer's whole history, in the
///                       order of ranks_before(); not empty
/// @param mean_before    n x 1, the mean before this update
/// @param minimum_noise  n x 1, the diagonal of S_min
/// @return               nothing if the roll-outs weigh nothing (every reward is 0)
std::optional<SearchDistribution> power_update(std::span<const RatedRollout> best,
                                               const Eigen::VectorXd& mean_before,
                                               const Eigen::VectorXd& minimum_noise);

}  // namespace treeroll::explore
