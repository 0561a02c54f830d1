#pragma once

#include <Eigen/Core>
#include <array>

namespace treeroll {

/// The demonstration of the swing-up, thesis section 4-3-1: a cart path that is a sum of cosines
/// and rests at both ends. The defaults are the thesis's.
struct CartAcceleration {
  double duration_s = 2.2;                              ///< T
  int num_samples = 200;                                ///< equally spaced, both ends included
  std::array<double, 4> p_m{-.106, -.185, .092, .134};  ///< p_1 .. p_4 of (4-4)
};

/// Data as the fits take them, a column an observation: 2 x num_samples, time in s over the
/// acceleration of the cart in m/s^2, (4-5). Precondition: at least 2 samples.
Eigen::MatrixXd demonstrate(const CartAcceleration& settings);

}  // namespace treeroll
