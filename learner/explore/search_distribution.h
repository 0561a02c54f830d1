#pragma once

#include <Eigen/Core>

namespace treeroll::explore {

/// What theta is drawn from: N(mean, noise).
struct SearchDistribution {
  Eigen::VectorXd mean;   ///< n x 1
  Eigen::MatrixXd noise;  ///< n x n, symmetric positive definite: the exploration noise
};

}  // namespace treeroll::explore
