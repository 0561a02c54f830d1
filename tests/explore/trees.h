#pragma once

#include "common/policy/tree/tree_policy.h"
#include "learner/explore/exploration.h"

namespace treeroll::explore {

/// Gaussians with means (time, 0) equally spaced over [0, 2], one input and one output.
Gmm spaced_gmm(int num_components);
/// One layer of two Gaussians: 4 elements of theta in the layout of means.
TreeModel flat_tree();
/// Two Gaussians over four.
TreeModel two_layer_tree();
/// Two Gaussians over two, one below each, over four: theta of layers 1 and 2 has one size.
TreeModel three_layer_tree();

/// The policy of a run over trees.
const TreePolicy& tree_policy(const Exploration& run, int layer);

/// For theta in the layout of means: variances .01 and .04 of each component.
ExplorationSettings settings_for_means();

/// A run over the layout of means with seed 7.
Exploration run_over_means(const ExplorationSettings& settings, TreeModel start,
                           std::uint32_t repetition = 0);

}  // namespace treeroll::explore
