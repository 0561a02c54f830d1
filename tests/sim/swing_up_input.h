#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "sim/cart_pendulum.h"

namespace treeroll::sim {

/// Free parameters p of the cosine series (4-4), with T = 2.2 s.
using CosineSeries = std::array<double, 4>;
inline constexpr double kSwingUpDurationS = 2.2;

/// As printed in section 4-3-1: open loop it does not reach upright.
inline constexpr CosineSeries kPublished = {-.106, -.185, .092, .134};
/// Refined until the swing-up ends upright at T.
inline constexpr CosineSeries kRefined = {-.1086310, -.1879148, .0932248, .1343913};

/// Hanging at rest. From -pi the input +ydd of (4-5) swings up to 0, not to 2 pi.
inline constexpr CartPendulumState kHanging{.phi1 = -std::numbers::pi, .phi2 = -std::numbers::pi};

/// Acceleration of the cart in m/s^2, thesis (4-5).
inline double cart_acceleration(const CosineSeries& p, double time_s) {
  const double w = std::numbers::pi / kSwingUpDurationS;
  const double a1 = -p[1] - p[3];
  double sum = -w * w * a1 * std::cos(w * time_s);
  for (int i = 2; i <= 5; ++i) sum -= (i * w) * (i * w) * p[i - 2] * std::cos(i * w * time_s);
  return sum;
}

inline CartAcceleration feed_forward(const CosineSeries& p) {
  return [p](double time_s, const CartPendulumState&) { return cart_acceleration(p, time_s); };
}

/// Lets a simulation go on to its end.
inline bool go_on(double, const CartPendulumState&, double) { return true; }

}  // namespace treeroll::sim
