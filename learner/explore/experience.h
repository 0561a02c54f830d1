#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/policy/policy.h"
#include "learner/explore/best_rollouts.h"

namespace treeroll {

/// Theta of the next layer that acts as `theta` acted at the layer left: thesis (3-16)..(3-18),
/// solved for each component of the next layer. The print lacks the blocks' labels and a sign:
///
///   A~    = S~_OI (S~_II)^-1
///   S^_OI = A~ S_II
///   mu^_O = mu~_O - A~ mu~_I + A~ mu_I
///
/// so that each component keeps its linear map exactly, and the regression the whole curve where
/// the input means and variances that theta does not hold have not moved. Where theta holds the
/// input means they are those of the roll-out, mu_I = mu~_I.
/// @param left   policy that theta belongs to
/// @param next   policy of the layer below it: its tree supplies what theta does not hold
/// @param theta  finite, left.theta_dim()
/// @return       next.theta_dim(); nothing if theta is so extreme that no mixture represents it
std::optional<Eigen::VectorXd> project_experience(const Policy& left, const Policy& next,
                                                  const Eigen::VectorXd& theta);

/// The roll-outs of the layer left as roll-outs of the next. Those that no mixture of the next
/// layer represents (in practice failed ones, with a theta past all bounds) are left out.
std::vector<RatedRollout> project_experience(const Policy& left, const Policy& next,
                                             std::span<const RatedRollout> rollouts);

/// Derivative of project_experience() at the roll-out `theta`, by central differences: column i
/// says where a step along theta_i leads in the next layer. Its columns span what has been
/// explored.
/// @param deviation  left.theta_dim(), above 0: the scale of each element's exploration
/// @return           next.theta_dim() x left.theta_dim(); nothing where theta is too extreme
std::optional<Eigen::MatrixXd> experience_jacobian(const Policy& left, const Policy& next,
                                                   const Eigen::VectorXd& theta,
                                                   const Eigen::VectorXd& deviation);

/// Noise with variance added in the directions the layer left could not explore, section 3-2-4:
/// .3 of the explored directions' deviation, lengths taken in units of `unit`. Without it a search
/// begun with projected noise would stay in a sub-space.
/// @param noise     n x n, of the projected experience
/// @param jacobian  n x n1, of experience_jacobian()
/// @param unit      n x 1, above 0: what counts as a step of length 1 in each element
Eigen::MatrixXd with_unexplored_directions(const Eigen::MatrixXd& noise,
                                           const Eigen::MatrixXd& jacobian,
                                           const Eigen::VectorXd& unit);

}  // namespace treeroll
