#pragma once

#include <Eigen/Core>

namespace treeroll {

/// Lower Cholesky factor L of a covariance, S = L L^T (3-12), positive diagonal. Throws
/// std::invalid_argument if `covariance` is not (numerically) positive definite.
Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& covariance);

/// Principal axes of a covariance as the columns of a rotation, (3-1): an element of SO(d), the
/// axis of the largest variance first. Eigenvectors have no sign: here the largest element of each
/// axis is positive, and the last axis completes a right-handed frame.
Eigen::MatrixXd principal_axes(const Eigen::MatrixXd& covariance);

/// Principal axes that continue the frame `before`, so that what hangs on the frame turns with the
/// covariance and does not flip.
/// d = 2: the angle of the first axis is the one nearest to its angle before, modulo pi.
/// d > 2: each axis continues the one before that it overlaps most, whatever the order of the
/// variances; where the signs do not make a rotation, the axis of least overlap gives way.
/// Without a distinct principal axis (a circle, d = 2) the frame before stays.
/// @param before  d x d, an element of SO(d)
Eigen::MatrixXd principal_axes(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& before);

}  // namespace treeroll
