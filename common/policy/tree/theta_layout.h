#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>

#include "common/mixture/gmm.h"

namespace treeroll {

/// Which parameters of a mixture are explored (theta); the rest (phi) stay as they are. Psi is a
/// block of dO x dI numbers, row by row, from which S_OI follows:
/// - Cholesky: the block of L with row in the outputs and column in the inputs, (3-12), (A-21);
/// - Pourahmadi: the negative of that block of T in T S T^T = D, (A-24), (A-27).
/// Both leave S_II and the variance of the outputs given the inputs as they are, and reach
/// every slope S_OI S_II^-1. For one input and one output the slope is psi / zeta_1 with Cholesky
/// and psi itself with Pourahmadi.
enum class ThetaLayout {
  kMeans,              ///< theta_k = mean, d: section 4-1
  kMeansCholesky,      ///< theta_k = [mean; psi], (3-11), d + dI dO
  kMeansPourahmadi,    ///< the same with the psi of Pourahmadi
  kReducedCholesky,    ///< theta_k = [mean of the outputs; psi], (A-17), dO + dI dO
  kReducedPourahmadi,  ///< the same with the psi of Pourahmadi
};

/// Names in settings and in JSON, in the order of the enumeration.
inline constexpr std::array<std::string_view, 5> kThetaLayoutNames = {
    "means", "means_cholesky", "means_pourahmadi", "reduced_cholesky", "reduced_pourahmadi"};

/// Elements of theta for one component, in the order above.
int theta_dim_per_component(ThetaLayout layout, int input_dim, int output_dim);

/// theta = [theta_1; ...; theta_K], (3-9).
Eigen::VectorXd to_theta(ThetaLayout layout, const Gmm& gmm);

/// The mixture with theta in place of its own: phi is taken from `gmm`. Precondition: theta is
/// finite and has the size of to_theta(layout, gmm). Positive definite on paper, since the diagonal
/// blocks of L (or T and D) are phi's; throws std::invalid_argument, naming the component, where
/// theta is so large (psi some 1e7 times the deviation it sits beside, a mean past
/// kGmmMagnitudeMax) that this is lost in rounding.
Gmm with_theta(ThetaLayout layout, const Gmm& gmm, const Eigen::Ref<const Eigen::VectorXd>& theta);

}  // namespace treeroll
