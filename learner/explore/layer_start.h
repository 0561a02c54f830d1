#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/policy/policy.h"
#include "learner/explore/best_rollouts.h"
#include "learner/explore/exploration_settings.h"
#include "learner/explore/search_distribution.h"

namespace treeroll {

/// What the search within a layer begins with.
struct LayerStart {
  SearchDistribution distribution;
  Eigen::VectorXd noise_variance;        ///< n x 1: gamma = 1, (minimum noise) / eps_noise
  std::vector<RatedRollout> experience;  ///< of earlier layers, in theta of this one
};

/// The policy as it stands with the initial noise and no experience.
LayerStart fresh_start(const ExplorationSettings& settings, const Policy& policy);

/// What a layer that is left hands on.
struct LeftLayer {
  const SearchDistribution& distribution;  ///< as it was left
  std::span<const RatedRollout> best;      ///< its best roll-outs, best first
};

/// Theta of the layer left from whose policy the next layer goes on: the mean; with a population
/// rule that reuses experience the best roll-out, for the mean of a population lags behind.
Eigen::VectorXd carried_theta(const ExplorationSettings& settings, const LeftLayer& left);

/// The start of the next layer with the experience of the one left, section 3-2-4.
/// PoWER: the projected best I roll-outs, and the noise of (3-15) over them.
/// Population rules: no roll-outs; noise J S J^T, S the noise of the layer left, J the projection's
/// derivative. Either noise gets variance in unexplored directions. Where there is nothing to go by
/// (every reward 0, a theta too extreme to project) the noise is the initial one.
/// @param carried  carried_theta(), which `next` was made from
LayerStart start_with_experience(const ExplorationSettings& settings, const LeftLayer& left,
                                 const NextLayer& next, const Eigen::VectorXd& carried,
                                 int num_results_of_run);

}  // namespace treeroll
