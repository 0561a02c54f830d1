#pragma once

#include <Eigen/Core>

namespace treeroll {

/// The matrix whose two triangles are the lower one of `matrix`: undoes what rounding did to a
/// product that is symmetric on paper.
Eigen::MatrixXd mirrored(const Eigen::MatrixXd& matrix);

/// Adds row row^T to the lower triangle of `matrix`. A sum of many is written out with this where
/// its bits must be the same on every machine: Eigen cuts a long product into pieces by the size of
/// the processor's caches.
void add_square(const Eigen::Ref<const Eigen::VectorXd>& row, Eigen::MatrixXd& matrix);

}  // namespace treeroll
