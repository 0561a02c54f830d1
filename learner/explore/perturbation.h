#pragma once

#include <Eigen/Core>

#include "common/base/random_stream.h"

namespace treeroll {

/// Lower Cholesky factor of the exploration noise. A noise that is singular within rounding (old
/// roll-outs far apart, a minimum noise decayed to next to nothing) is factorised with its
/// diagonal raised by the least of 1e-14, 1e-13, ... of itself that suffices: far below what the
/// directions concerned are known to.
/// @param noise  n x n, symmetric, positive semi-definite within rounding, diagonal above 0
Eigen::MatrixXd noise_factor(const Eigen::MatrixXd& noise);

/// theta~ = mean + factor z, line 6 of thesis algorithm 2, z standard normal. Element i of z is
/// the i-th normal number of the stream: the first elements do not depend on n.
/// @param factor  n x n, of noise_factor()
Eigen::VectorXd perturb(const Eigen::VectorXd& mean, const Eigen::MatrixXd& factor,
                        RandomStream stream);

}  // namespace treeroll
