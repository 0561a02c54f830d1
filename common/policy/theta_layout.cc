#include "common/policy/theta_layout.h"

#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/policy/frame.h"

namespace treeroll {

int theta_dim_per_component(ThetaLayout layout, int input_dim, int output_dim) {
  const int dim = input_dim + output_dim;
  return layout == ThetaLayout::kMeans ? dim : dim + input_dim * output_dim;
}

Eigen::VectorXd to_theta(ThetaLayout layout, const Gmm& gmm) {
  const int num_inputs = gmm.input_dim();
  const int size = theta_dim_per_component(layout, num_inputs, gmm.output_dim());
  Eigen::VectorXd theta(size * gmm.num_components());
  for (int k = 0; k < gmm.num_components(); ++k) {
    theta.segment(k * size, gmm.dim()) = gmm[k].mean;
    if (layout == ThetaLayout::kMeans) continue;
    const Eigen::MatrixXd factor = cholesky_factor(gmm[k].covariance);
    int next = k * size + gmm.dim();
    for (int row = num_inputs; row < gmm.dim(); ++row) {
      for (int column = 0; column < num_inputs; ++column) theta[next++] = factor(row, column);
    }
  }
  return theta;
}

Gmm with_theta(ThetaLayout layout, const Gmm& gmm, const Eigen::Ref<const Eigen::VectorXd>& theta) {
  const int num_inputs = gmm.input_dim();
  const int num_outputs = gmm.output_dim();
  const int size = theta_dim_per_component(layout, num_inputs, num_outputs);
  CHECK(theta.size() == size * gmm.num_components(), "theta has the size of the layout");
  CHECK(theta.allFinite(), "theta is finite");
  std::vector<Component> components = gmm.components();
  for (int k = 0; k < gmm.num_components(); ++k) {
    Component& component = components[static_cast<std::size_t>(k)];
    component.mean = theta.segment(k * size, gmm.dim());
    if (layout == ThetaLayout::kMeans) continue;
    // S = L L^T (3-12) block by block: S_II stays to the bit, psi alone is new.
    const Eigen::MatrixXd factor = cholesky_factor(component.covariance);
    Eigen::MatrixXd psi(num_outputs, num_inputs);
    int next = k * size + gmm.dim();
    for (int row = 0; row < num_outputs; ++row) {
      for (int column = 0; column < num_inputs; ++column) psi(row, column) = theta[next++];
    }
    const Eigen::MatrixXd l_ii = factor.topLeftCorner(num_inputs, num_inputs);
    const Eigen::MatrixXd l_oo = factor.bottomRightCorner(num_outputs, num_outputs);
    const Eigen::MatrixXd s_oi = psi * l_ii.transpose();
    component.covariance.bottomLeftCorner(num_outputs, num_inputs) = s_oi;
    component.covariance.topRightCorner(num_inputs, num_outputs) = s_oi.transpose();
    component.covariance.bottomRightCorner(num_outputs, num_outputs) =
        psi * psi.transpose() + l_oo * l_oo.transpose();
  }
  return Gmm(num_inputs, std::move(components));
}

}  // namespace treeroll
