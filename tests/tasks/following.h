#pragma once

#include <vector>

#include "common/mixture/gmm.h"
#include "tests/sim/swing_up_input.h"

namespace treeroll {

/// As many narrow Gaussians as follow an acceleration over time closely: each contributes the
/// tangent of the curve at its mean.
inline Gmm following(const sim::CosineSeries& p) {
  std::vector<Component> components;
  constexpr int kNum = 1500;
  constexpr double kDurationS = 2.5, kWidthS = kDurationS / kNum / 2, kH = 1e-5;
  for (int k = 0; k < kNum; ++k) {
    const double t = (k + .5) * kDurationS / kNum;
    const double slope =
        (sim::cart_acceleration(p, t + kH) - sim::cart_acceleration(p, t - kH)) / (2 * kH);
    const double variance = kWidthS * kWidthS;
    Eigen::Matrix2d covariance;
    covariance << variance, slope * variance, slope * variance, slope * slope * variance + 1e-4;
    components.push_back({.prior = 1. / kNum,
                          .mean = Eigen::Vector2d(t, sim::cart_acceleration(p, t)),
                          .covariance = covariance});
  }
  return Gmm(1, components);
}

}  // namespace treeroll
