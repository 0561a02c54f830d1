#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/numbers/random_stream.h"

namespace treeroll::explore {

/// Lower Cholesky factor of the exploration noise. A noise that is singular within rounding (old
/// roll-outs far apart, a minimum noise decayed to next to nothing) is factorised with its
/// diagonal raised by the least of 1e-14, 1e-13, ... of itself that suffices: far below what the
/// directions concerned are known to.
/// @param noise  n x n, symmetric
/// @return nothing for one that is not finite and positive semi-definite within rounding, or whose
///         diagonal is not above 0
std::optional<Eigen::MatrixXd> noise_factor_if_any(const Eigen::MatrixXd& noise);
/// Precondition: there is one.
Eigen::MatrixXd noise_factor(const Eigen::MatrixXd& noise);

/// n standard normal numbers. Element i is the i-th of the stream: the first elements do not depend
/// on n.
Eigen::VectorXd normal_numbers(Eigen::Index n, RandomStream stream);

/// theta~ = mean + factor z, line 6 of thesis algorithm 2.
/// @param factor  n x n, of noise_factor()
/// @param normal  n x 1, z of normal_numbers()
Eigen::VectorXd perturb(const Eigen::VectorXd& mean, const Eigen::MatrixXd& factor,
                        const Eigen::VectorXd& normal);

}  // namespace treeroll::explore
