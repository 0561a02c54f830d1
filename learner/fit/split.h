#pragma once

#include <Eigen/Core>
#include <utility>

#include "common/mixture/gmm.h"

namespace treeroll {

/// The vector a, with a a^T <= S, along which a Gaussian is split.
enum class SplitAxis {
  kCholesky,   ///< first column of L, (zeta_1, psi): along the first input and the regression line
  kPrincipal,  ///< sqrt(lambda_1) v_1, the thesis's
};

/// The parameters of (3-6), each in (0, 1).
struct SplitSettings {
  SplitAxis axis = SplitAxis::kCholesky;
  double alpha = .5;  ///< share of the first child
  double beta = .5;   ///< division of the variance along the axis
  double u = .5;      ///< distance of the means
};

/// Two Gaussians in place of one, first the one at -a: thesis (3-6). The print has sign errors and
/// equal priors; the form used here keeps the moments of order 0, 1 and 2 exactly. Throws
/// std::invalid_argument if `component` has no positive definite covariance.
std::pair<Component, Component> split(const Component& component, const SplitSettings& settings);

/// One Gaussian in place of two, with their moments of order 0, 1 and 2. Precondition: the priors
/// are not both zero.
Component merge(const Component& first, const Component& second);

}  // namespace treeroll
