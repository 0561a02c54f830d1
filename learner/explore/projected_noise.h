#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/policy/policy.h"

namespace treeroll::explore {

/// Derivative of a projection at the roll-out `theta`, by central differences: column i says where
/// a step along theta_i leads in the next layer. Its columns span what has been explored.
/// @param deviation  of the layer left, above 0: the scale of each element's exploration
/// @return           n x n1 for a theta of n1 and n elements; nothing where theta is too extreme
std::optional<Eigen::MatrixXd> projection_jacobian(const Projection& project,
                                                   const Eigen::VectorXd& theta,
                                                   const Eigen::VectorXd& deviation);

/// Noise with variance added in the directions the layer left could not explore, section 3-2-4:
/// .3 of the explored directions' deviation, lengths taken in units of `unit`. Without it a search
/// begun with projected noise would stay in a sub-space.
/// @param noise     n x n, of the projected experience
/// @param jacobian  n x n1, of projection_jacobian()
/// @param unit      n x 1, above 0: what counts as a step of length 1 in each element
Eigen::MatrixXd with_unexplored_directions(const Eigen::MatrixXd& noise,
                                           const Eigen::MatrixXd& jacobian,
                                           const Eigen::VectorXd& unit);

}  // namespace treeroll::explore
