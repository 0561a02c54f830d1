#pragma once

#include <Eigen/Core>

namespace treeroll {

/// The matrix whose two triangles are the lower one of `matrix`: undoes what rounding did to a
/// product that is symmetric on paper.
Eigen::MatrixXd mirrored(const Eigen::MatrixXd& matrix);

}  // namespace treeroll
