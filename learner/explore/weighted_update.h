#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "learner/explore/update_rule.h"

namespace treeroll::explore {

/// Weights of PI2-BB (Stulp and Sigaud 2012), for a reward r:
///   w_i = exp(h (r_i - r_max) / (r_max - r_min)) / sum
/// Equal rewards weigh alike. Affine changes of all rewards change nothing.
/// @param generation  not empty
/// @param eliteness   h, above 0: the larger, the fewer members count
std::vector<double> pi2_weights(std::span<const ToldRollout> generation, double eliteness);

/// Weights of the cross-entropy method: 1 / num_elites for the best, in the order of
/// ranks_before(), 0 for the others.
/// @param num_elites  1 to the size of the generation
std::vector<double> cem_weights(std::span<const ToldRollout> generation, int num_elites);

/// How far the noise follows a generation.
struct NoiseUpdate {
  double learning_rate = 1;       ///< from the noise before (0) to that of the generation (1)
  double decay = 1;               ///< factor on the noise at each update, minimum noise aside
  Eigen::VectorXd minimum_noise;  ///< n x 1, the diagonal of S_min
};

/// One step of PI2-BB or CEM:
///   mean  <- sum_i w_i theta~_i
///   noise <- (1 - rate) decay noise + rate (decay sum_i w_i e_i e_i^T + S_min)
/// e_i the perturbation of theta~_i from the mean it was drawn from, so that a stale member says
/// what its own perturbation was worth and not how far the mean has gone since.
/// @param weights  one for each member, sum 1
SearchDistribution weighted_update(std::span<const ToldRollout> generation,
                                   std::span<const double> weights,
                                   const SearchDistribution& before, const NoiseUpdate& noise);

}  // namespace treeroll::explore
