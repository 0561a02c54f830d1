#include "common/policy/tree/tree_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "common/policy/tree/experience.h"
#include "common/policy/tree/sensitivity.h"
#include "common/policy/tree/tree_controller.h"

namespace treeroll {
namespace {

/// How far from their means Gaussians are worth seeing, in standard deviations.
constexpr double kSeenDeviations = 2;

int component_dim(ThetaLayout layout, const TreeModel& tree) {
  return theta_dim_per_component(layout, tree.input_dim(), tree.dim() - tree.input_dim());
}

}  // namespace

TreePolicy::TreePolicy(TreeModel tree, int layer, ThetaLayout layout)
    : tree_(std::move(tree)), layer_(layer), layout_(layout) {
  CHECK(1 <= layer && layer <= tree_.num_layers(), "a layer is from 1 to num_layers()");
}

PolicyPtr TreePolicy::at_layer(int layer) const {
  return std::make_shared<TreePolicy>(tree_, layer, layout_);
}

int TreePolicy::theta_dim() const {
  return component_dim(layout_, tree_) * tree_.num_components(layer_);
}

Eigen::VectorXd TreePolicy::theta() const { return to_theta(layout_, tree_.layer(layer_)); }

TreeModel TreePolicy::tree_with(const Eigen::VectorXd& theta) const {
  return tree_.with_layer(layer_, with_theta(layout_, tree_.layer(layer_), theta));
}

Gmm TreePolicy::decode(const Eigen::VectorXd& theta) const { return tree_with(theta).finest(); }

PolicyPtr TreePolicy::with(const Eigen::VectorXd& theta) const {
  return std::make_shared<TreePolicy>(tree_with(theta), layer_, layout_);
}

std::unique_ptr<Controller> TreePolicy::controller() const {
  return std::make_unique<TreeController>(tree_.finest());
}

NextLayer TreePolicy::next_layer(const Eigen::VectorXd& theta) const {
  const auto next = std::make_shared<const TreePolicy>(tree_with(theta), layer_ + 1, layout_);
  return {next, [left = *this, next](const Eigen::VectorXd& of_left) {
            return project_experience(left, *next, of_left);
          }};
}

int TreePolicy::noise_variance_dim() const { return component_dim(layout_, tree_); }

Eigen::VectorXd TreePolicy::noise_variance(std::span<const double> given) const {
  const auto size = static_cast<Eigen::Index>(given.size());
  CHECK(size == noise_variance_dim(), "noise_variance does not fit the layout of theta");
  return Eigen::Map<const Eigen::VectorXd>(given.data(), size)
      .replicate(tree_.num_components(layer_), 1);
}

Eigen::VectorXd TreePolicy::steps_of_equal_effect() const { return sensitivity_scale(*this); }

PolicyEffect TreePolicy::effect() const { return tree_effect(*this); }

PolicySketch TreePolicy::sketch() const {
  PolicySketch sketch;
  for (int layer = 1; layer <= num_layers(); ++layer) {
    const Gmm gmm = tree_.layer(layer);
    PolicySketch::Layer& seen = sketch.layers.emplace_back();
    for (const Component& component : gmm.components()) {
      seen.gaussians.push_back({component.mean, component.covariance});
    }
    seen.controller = std::make_unique<TreeController>(gmm);
  }
  for (int input = 0; input < input_dim(); ++input) {
    PolicySketch::Range seen{.low = std::numeric_limits<double>::infinity(),
                             .high = -std::numeric_limits<double>::infinity()};
    for (const PolicySketch::Gaussian& gaussian : sketch.layers.back().gaussians) {
      const double reach = kSeenDeviations * std::sqrt(gaussian.covariance(input, input));
      seen.low = std::min(seen.low, gaussian.mean[input] - reach);
      seen.high = std::max(seen.high, gaussian.mean[input] + reach);
    }
    sketch.inputs.push_back(seen);
  }
  sketch.look = to_json(TreePolicy(tree_, 1, ThetaLayout::kMeans));
  return sketch;
}

}  // namespace treeroll
