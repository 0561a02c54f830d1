#pragma once

#include <Eigen/Core>

namespace treeroll {

/// What is pulled by a spring and held back by a damper, without overshoot:
///
///   u'' = kp (uhat - u) - kv u',   kv = 2 sqrt(kp)
///
/// Each output by itself. It begins at rest on the attractor uhat, which goes in straight lines
/// from one column to the next. Each step is the exact solution, so that no stiffness is too great.
/// @param attractor  dO x N, N >= 1, equally spaced in time
/// @param step       from one column to the next, above 0, s
/// @param stiffness  kp, above 0, 1/s^2
/// @return           u at the same times, dO x N
Eigen::MatrixXd pulled_along(const Eigen::MatrixXd& attractor, double step, double stiffness);

/// The attractor along which a recorded curve is pulled: uhat = u + (u'' + kv u') / kp, by
/// derivatives of the parabola through each sample and its two neighbours.
/// @param recording  (1 + dO) x N, N >= 3: times that rise, over outputs
/// @return           the same, with uhat for u. A sample that is NaN leaves its neighbours NaN too.
Eigen::MatrixXd attractor_of(const Eigen::MatrixXd& recording, double stiffness);

}  // namespace treeroll
