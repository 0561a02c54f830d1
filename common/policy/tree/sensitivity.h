#pragma once

#include <Eigen/Core>

#include "common/policy/tree/tree_policy.h"

namespace treeroll {

/// Steps of theta that change the policy's output alike: s_i = 1 / rms(du / dtheta_i), u the
/// regression with the policy as it stands at the finest layer, by central differences; no roll-out
/// is needed. The root mean square is over inputs where the finest layer's Gaussians lie: their
/// means and up to 1.5 deviations along each axis of their input factor, weighted by their priors.
/// @return  n x 1, above 0, in units of theta_i per unit of output (the norm over the outputs). An
///          element that moves nothing has a bounded step all the same. In the output's unit it
///          counts as a tenth of the strongest where it moves less than a thousandth of that; a
///          mean input as moving the outputs' size within half its deviation where it moves less
///          than a thousandth of that.
Eigen::VectorXd sensitivity_scale(const TreePolicy& policy);

/// Policy::effect(), by central differences: for one input over the whole range of the Gaussians.
PolicyEffect tree_effect(const TreePolicy& policy);

}  // namespace treeroll
