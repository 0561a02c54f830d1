#include "common/policy/ds_gmr/spring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace treeroll {
namespace {

/// From `low` to `low` + duration, N columns of one row.
Eigen::RowVectorXd spread_times(double low, double duration, Eigen::Index count) {
  return Eigen::RowVectorXd::LinSpaced(count, low, low + duration);
}

TEST(SpringTest, RestsWhereNothingPulls) {
  const Eigen::MatrixXd still = Eigen::Vector2d(3, -1).replicate(1, 50);
  EXPECT_EQ(pulled_along(still, .1, 7), still);
}

/// u'' = kp (b t - u) - 2 sqrt(kp) u' from rest at 0: u = b t - 2 b / w + (2 b / w + b t) exp(-w
/// t).
TEST(SpringTest, IsTheSolutionAlongAStraightLine) {
  constexpr double kSlope = 3;
  for (const double stiffness : {.5, 40., 1600., 1e9}) {
    const Eigen::RowVectorXd times = spread_times(0, 2, 81);
    const Eigen::MatrixXd pulled = pulled_along(kSlope * times, 2. / 80, stiffness);
    const double w = std::sqrt(stiffness);
    for (Eigen::Index n = 0; n < times.size(); ++n) {
      const double t = times[n];
      EXPECT_NEAR(pulled(0, n), kSlope * (t - 2 / w) + kSlope * (2 / w + t) * std::exp(-w * t),
                  1e-12)
          << stiffness << " at " << t;
    }
  }
}

TEST(SpringTest, FinerStepsOfTheSameLinesChangeNothing) {
  const Eigen::MatrixXd corners = (Eigen::MatrixXd(1, 4) << 0, 2, -1, .5).finished();
  Eigen::MatrixXd between(1, 7);
  for (Eigen::Index n = 0; n < 7; ++n) {
    between(0, n) = (corners(0, n / 2) + corners(0, (n + 1) / 2)) / 2;
  }
  const Eigen::MatrixXd coarse = pulled_along(corners, .2, 30);
  const Eigen::MatrixXd fine = pulled_along(between, .1, 30);
  for (Eigen::Index n = 0; n < 4; ++n) EXPECT_NEAR(coarse(0, n), fine(0, 2 * n), 1e-14);
}

TEST(SpringTest, IsLinearInItsAttractor) {
  Eigen::MatrixXd first(1, 60), second(1, 60);
  for (Eigen::Index n = 0; n < 60; ++n) {
    first(0, n) = std::sin(.3 * static_cast<double>(n));
    second(0, n) = std::cos(.2 * static_cast<double>(n));
  }
  const Eigen::MatrixXd sum = pulled_along(2 * first - 5 * second, .03, 200);
  const Eigen::MatrixXd parts =
      2 * pulled_along(first, .03, 200) - 5 * pulled_along(second, .03, 200);
  EXPECT_LT((sum - parts).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(SpringTest, NeverOvershoots) {
  Eigen::MatrixXd step = Eigen::MatrixXd::Ones(1, 400);
  step(0, 0) = 0;
  const Eigen::MatrixXd pulled = pulled_along(step, .01, 100);
  for (Eigen::Index n = 1; n < pulled.cols(); ++n) {
    EXPECT_GE(pulled(0, n), pulled(0, n - 1));
    EXPECT_LE(pulled(0, n), 1);
  }
  EXPECT_NEAR(pulled(0, 399), 1, 1e-12);
}

/// Also where the samples are not equally spaced, and at both ends.
TEST(SpringTest, TheAttractorOfAParabolaIsExact) {
  const Eigen::RowVectorXd times = (Eigen::RowVectorXd(5) << -1, -.7, .1, .2, 2).finished();
  Eigen::MatrixXd recording(2, 5);
  recording.row(0) = times;
  recording.row(1) = 4 - 3 * times.array() + .5 * times.array().square();
  const Eigen::MatrixXd attractor = attractor_of(recording, 50);
  const double damping = 2 * std::sqrt(50.);
  for (Eigen::Index n = 0; n < 5; ++n) {
    const double velocity = -3 + times[n];
    EXPECT_NEAR(attractor(1, n), recording(1, n) + (1 + damping * velocity) / 50, 1e-13);
    EXPECT_EQ(attractor(0, n), times[n]);
  }
}

TEST(SpringTest, IsPulledAlongTheRecordedCurveByItsAttractor) {
  // Least jerk: at rest, without acceleration, at both ends.
  const Eigen::ArrayXXd s = spread_times(0, 1, 401);
  Eigen::MatrixXd recording(2, 401);
  recording.row(0) = 2 * s;
  recording.row(1) = 10 * s.pow(3) - 15 * s.pow(4) + 6 * s.pow(5);
  for (const double stiffness : {9., 100., 1600.}) {
    const Eigen::MatrixXd attractor = attractor_of(recording, stiffness);
    const Eigen::MatrixXd pulled = pulled_along(attractor.bottomRows(1), 2. / 400, stiffness);
    // At the ends a parabola has the acceleration of half a step away.
    EXPECT_LT((pulled - recording.bottomRows(1)).cwiseAbs().maxCoeff(),
              std::max(1e-3, .05 / stiffness))
        << stiffness;
  }
}

TEST(SpringTest, WhatIsMissingLeavesItsNeighboursUnknown) {
  Eigen::MatrixXd recording(3, 6);
  recording << 0, 1, 2, 3, 4, 5,  //
      0, 1, 2, NAN, 4, 5,         //
      0, 1, 4, 9, 16, 25;
  const Eigen::MatrixXd attractor = attractor_of(recording, 4);
  for (Eigen::Index n = 0; n < 6; ++n) {
    EXPECT_EQ(std::isnan(attractor(1, n)), n >= 2) << n;
    EXPECT_FALSE(std::isnan(attractor(2, n)));
  }
}

}  // namespace
}  // namespace treeroll
