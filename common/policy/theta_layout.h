#pragma once

#include <Eigen/Core>

#include "common/policy/gmm.h"

namespace treeroll {

/// Which parameters of a mixture are explored (theta); the rest (phi) stay as they are.
enum class ThetaLayout {
  kMeans,          ///< theta_k = mean, d: section 4-1
  kMeansCholesky,  ///< theta_k = [mean; psi], (3-11), d + dI dO: psi the block of the Cholesky
                   ///< factor L with row in the outputs and column in the inputs, row by row
};

/// Elements of theta for one component, in the order above.
int theta_dim_per_component(ThetaLayout layout, int input_dim, int output_dim);

/// theta = [theta_1; ...; theta_K], (3-9).
Eigen::VectorXd to_theta(ThetaLayout layout, const Gmm& gmm);

/// The mixture with theta in place of its own: phi is taken from `gmm`. Precondition: theta is
/// finite and has the size of to_theta(layout, gmm). Positive definite on paper, since the diagonal
/// blocks of L are phi's; throws std::invalid_argument, naming the component, where theta is so
/// large (psi some 1e7 times the deviation it sits beside, a mean past kGmmMagnitudeMax) that this
/// is lost in rounding.
Gmm with_theta(ThetaLayout layout, const Gmm& gmm, const Eigen::Ref<const Eigen::VectorXd>& theta);

}  // namespace treeroll
