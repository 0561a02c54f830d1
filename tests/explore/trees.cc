#include "trees.h"

#include <utility>

namespace treeroll::explore {

Gmm spaced_gmm(int num_components) {
  const double spacing = 2.0 / num_components;
  std::vector<Component> components;
  for (int k = 0; k < num_components; ++k) {
    const Eigen::Vector2d variance(spacing * spacing / 4, .1);
    components.push_back(
        {1.0 / num_components, Eigen::Vector2d((k + .5) * spacing, 0), variance.asDiagonal()});
  }
  return {1, std::move(components)};
}

TreeModel flat_tree() {
  return TreeModel::from_global(FrameKind::kCholesky, {spaced_gmm(2)}, {{}});
}

TreeModel two_layer_tree() {
  return TreeModel::from_global(FrameKind::kCholesky, {spaced_gmm(2), spaced_gmm(4)},
                                {{}, {0, 0, 1, 1}});
}

TreeModel three_layer_tree() {
  return TreeModel::from_global(FrameKind::kCholesky, {spaced_gmm(2), spaced_gmm(2), spaced_gmm(4)},
                                {{}, {0, 1}, {0, 0, 1, 1}});
}

const TreePolicy& tree_policy(const Exploration& run, int layer) {
  return dynamic_cast<const TreePolicy&>(run.policy(layer));
}

ExplorationSettings settings_for_means() {
  ExplorationSettings settings;
  settings.noise_variance = {.01, .04};
  return settings;
}

Exploration run_over_means(const ExplorationSettings& settings, TreeModel start,
                           std::uint32_t repetition) {
  return {settings, TreePolicy(std::move(start), 1, ThetaLayout::kMeans), 7, repetition};
}

}  // namespace treeroll::explore
