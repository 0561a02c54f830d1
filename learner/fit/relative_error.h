#pragma once

#include <Eigen/Core>

namespace treeroll {

/// What outputs are divided by where several count alike: the rms of each, 1 where that is 0.
/// @param outputs  dO x N; those that are missing (NaN) do not count
/// @return         dO numbers
Eigen::VectorXd output_units(const Eigen::MatrixXd& outputs);

/// rms of the errors of a curve, each output in its own unit.
/// @param curve    dO x N
/// @param outputs  dO x N, what it should be; those that are missing (NaN) do not count
double relative_rms(const Eigen::MatrixXd& curve, const Eigen::MatrixXd& outputs);

}  // namespace treeroll
