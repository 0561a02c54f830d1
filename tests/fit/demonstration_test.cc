#include "learner/fit/demonstration.h"

#include <gtest/gtest.h>

#include <cmath>

namespace treeroll {
namespace {

/// The cart's path, (4-4).
double position_m(const CartAcceleration& settings, double time_s) {
  const auto& p = settings.p_m;
  double y = -p[0] - p[2] + (-p[1] - p[3]) * std::cos(M_PI * time_s / settings.duration_s);
  for (std::size_t i = 2; i <= 5; ++i) {
    y += p[i - 2] * std::cos(static_cast<double>(i) * M_PI * time_s / settings.duration_s);
  }
  return y;
}

TEST(DemonstrationTest, IsTheSecondDerivativeOfThePath) {
  const CartAcceleration settings;
  const Eigen::MatrixXd data = demonstrate(settings);
  ASSERT_EQ(data.rows(), 2);
  ASSERT_EQ(data.cols(), 200);
  EXPECT_EQ(data(0, 0), 0);
  EXPECT_EQ(data(0, 199), 2.2);
  constexpr double kStep = 1e-4;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    const double t = data(0, n);
    const double second_difference =
        (position_m(settings, t + kStep) - 2 * position_m(settings, t) +
         position_m(settings, t - kStep)) /
        (kStep * kStep);
    EXPECT_NEAR(data(1, n), second_difference, 1e-5) << t;
  }
}

TEST(DemonstrationTest, LeavesTheCartWhereItWasAndAtRest) {
  CartAcceleration settings;
  settings.num_samples = 20001;
  const Eigen::MatrixXd data = demonstrate(settings);
  double velocity = 0;
  double position = 0;
  for (Eigen::Index n = 1; n < data.cols(); ++n) {
    const double step = data(0, n) - data(0, n - 1);
    const double next = velocity + .5 * step * (data(1, n) + data(1, n - 1));
    position += .5 * step * (velocity + next);
    velocity = next;
  }
  EXPECT_NEAR(velocity, 0, 1e-6);
  EXPECT_NEAR(position, 0, 1e-6);
}

}  // namespace
}  // namespace treeroll
