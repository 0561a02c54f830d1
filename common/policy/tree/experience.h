#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/policy/tree/tree_policy.h"

namespace treeroll {

/// Theta of the next layer that acts as `theta` acted at the layer left: thesis (3-16)..(3-18),
/// solved for each component of the next layer. The print lacks the blocks' labels and a sign:
///
///   S^_OI = A~ S_II        mu^_O = mu~_O - A~ mu~_I + A~ mu_I        A~ = S~_OI (S~_II)^-1
///
/// so that each component keeps its linear map exactly, and the regression the whole curve where
/// the input means and variances that theta does not hold have not moved. Where theta holds the
/// input means they are those of the roll-out, mu_I = mu~_I.
/// @param left   policy that theta belongs to
/// @param next   policy of the layer below it: its tree supplies what theta does not hold
/// @param theta  finite, left.theta_dim()
/// @return       next.theta_dim(); nothing if theta is so extreme that no mixture represents it
std::optional<Eigen::VectorXd> project_experience(const TreePolicy& left, const TreePolicy& next,
                                                  const Eigen::VectorXd& theta);

}  // namespace treeroll
