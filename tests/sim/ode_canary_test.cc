#include "sim/ode_canary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/base/content_hash.h"
#include "sim/ode_plant.h"

namespace treeroll::sim {
namespace {

/// The same motion, but for one last bit of its start if asked.
std::string digest(double phi1) {
  OdePlant plant(DoublePendulum{}, 1e-3);
  std::string bits;
  const auto add = [&bits](double, const CartPendulumState& s, double) {
    for (const double number : {s.phi1, s.phi2, s.y, s.phi1_rate, s.phi2_rate, s.y_rate}) {
      bits.append(reinterpret_cast<const char*>(&number), sizeof number);
    }
    return true;
  };
  const auto end = plant.simulate(
      {.phi1 = phi1, .phi2 = -2.1, .y = .05, .phi1_rate = 1.5}, 2,
      [](double t, const CartPendulumState& s) { return 8 - 12 * t + 3 * s.phi1_rate - 20 * s.y; },
      add);
  EXPECT_TRUE(end);
  return to_hex(content_hash(bits)).substr(0, 8);
}

TEST(OdeCanaryTest, IsOfEachBitOfTheMotionAndTheSameEachTime) {
  const std::string canary = ode_canary();
  EXPECT_EQ(canary.size(), 8U);
  EXPECT_EQ(canary, ode_canary());
  EXPECT_EQ(canary, digest(.7));
  EXPECT_NE(canary, digest(std::nextafter(.7, 1)));
}

}  // namespace
}  // namespace treeroll::sim
