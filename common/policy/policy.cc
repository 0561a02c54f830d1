#include "common/policy/policy.h"

namespace treeroll {

int Policy::theta_dim() const {
  return theta_dim_per_component(layout, tree.input_dim(), tree.dim() - tree.input_dim()) *
         tree.num_components(layer);
}

Eigen::VectorXd Policy::theta() const { return to_theta(layout, tree.layer(layer)); }

TreeModel Policy::tree_with(const Eigen::Ref<const Eigen::VectorXd>& theta) const {
  return tree.with_layer(layer, with_theta(layout, tree.layer(layer), theta));
}

Gmm Policy::decode(const Eigen::Ref<const Eigen::VectorXd>& theta) const {
  return tree_with(theta).finest();
}

}  // namespace treeroll
