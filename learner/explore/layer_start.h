#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/policy/policy.h"
#include "learner/explore/best_rollouts.h"
#include "learner/explore/search_distribution.h"

namespace treeroll::explore {

struct ExplorationSettings;
class UpdateRule;

/// What the search within a layer begins with.
struct LayerStart {
  SearchDistribution distribution;
  Eigen::VectorXd noise_variance;        ///< n x 1: gamma = 1, (minimum noise) / eps_noise
  std::vector<RatedRollout> experience;  ///< of earlier layers, in theta of this one
  /// What multiplies the deviations of the initial noise for a start that is far from good: for
  /// rules that try. 1 where nothing is known of it, and in a layer that reuses experience.
  double bolder = 1;
  /// Noises that go with some sizes of the output, where the policy does nothing and nobody has
  /// told the size: for rules that try, with `bolder`. The first is `distribution`'s. Empty where
  /// the size is known.
  std::vector<Eigen::MatrixXd> of_scales = {};
  /// Of systematic_steps(), for rules that try. Empty where the policy does nothing, and but in the
  /// first layer: what is learnt by then is no demonstration.
  std::vector<Eigen::VectorXd> systematic_steps = {};
};

/// The policy as it stands with the initial noise and no experience.
LayerStart fresh_start(const ExplorationSettings& settings, const Policy& policy);

/// What runs with these settings begin with: fresh_start() of their first layer, and what its
/// demonstration may be wrong by.
LayerStart first_start(const ExplorationSettings& settings, const Policy& start);

/// The roll-outs of a layer that is left as roll-outs of the next. Those that no policy of the next
/// layer represents (in practice failed ones, with a theta past all bounds) are left out.
std::vector<RatedRollout> projected(const Projection& project,
                                    std::span<const RatedRollout> rollouts);

/// The way of roll-outs from a layer that is left into the next one.
struct LayerPassage {
  const Projection& project;
  const LayerStart& start;  ///< fresh_start() of the next layer
  /// Derivative of the projection at the theta carried over; none where that is too extreme.
  const std::optional<Eigen::MatrixXd>& jacobian;
  int num_results_of_run;
};

/// What a layer that is left gives to the next one.
struct Inheritance {
  std::vector<RatedRollout> experience;  ///< in theta of the next layer
  /// Of the explored directions, n x n of the next layer; none: the initial noise.
  std::optional<Eigen::MatrixXd> noise;
};

/// The start of the next layer with the experience of the one left, section 3-2-4: what its rule
/// gives, the noise with variance added in unexplored directions. Where there is nothing to go by
/// (every reward 0, a theta too extreme to project) the noise is the initial one.
/// @param rule     of the layer left
/// @param carried  rule.carried_theta(), which `next` was made from
LayerStart start_with_experience(const ExplorationSettings& settings, const UpdateRule& rule,
                                 const NextLayer& next, const Eigen::VectorXd& carried,
                                 int num_results_of_run);

}  // namespace treeroll::explore
