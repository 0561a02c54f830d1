#include "learner/fit/missing_outputs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "common/mixture/gmr.h"
#include "common/numbers/random_stream.h"
#include "learner/fit/em.h"
#include "learner/fit/regression_fit.h"

namespace treeroll {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

Component gaussian() {
  Component component{.prior = .4, .mean = Eigen::Vector3d(1, 2, 3), .covariance = {}};
  component.covariance.resize(3, 3);
  component.covariance << 2, .5, -1, .5, 1, .3, -1, .3, 4;
  return component;
}

/// A time and two outputs that go together, and a ripple.
Eigen::MatrixXd two_outputs(int num_samples) {
  RandomStream random(6, 0, 0, RandomPurpose::kPopulation);
  Eigen::MatrixXd data(3, num_samples);
  for (int n = 0; n < num_samples; ++n) {
    const double t = 2. * n / (num_samples - 1);
    const double x = std::sin(3 * t) + .05 * random.next_normal();
    data.col(n) << t, x, 5 - 2 * x + .05 * random.next_normal();
  }
  return data;
}

TEST(MissingOutputsTest, TheRowsOfASampleAreThoseThatItHas) {
  EXPECT_EQ(rows_of(Eigen::Vector4d(1, kMissing, 2, kMissing)), (std::vector<Eigen::Index>{0, 2}));
  Eigen::MatrixXd data = Eigen::MatrixXd::Zero(2, 3);
  EXPECT_TRUE(is_complete(data));
  data(1, 2) = kMissing;
  EXPECT_FALSE(is_complete(data));
}

TEST(MissingOutputsTest, WhatIsExpectedIsTheRegressionOnWhatIsThere) {
  const Component component = gaussian();
  Eigen::MatrixXd data(3, 2);
  data << 1.5, 0, 7, 8, kMissing, 9;
  const Eigen::MatrixXd filled =
      completed(component, data, Eigen::VectorXd::Ones(data.cols())).data;
  EXPECT_EQ(filled.col(1), data.col(1));
  Component whole = component;
  whole.prior = 1;
  const Eigen::VectorXd by_regression = Gmr(Gmm(2, {whole})).regress(Eigen::Vector2d(1.5, 7));
  EXPECT_NEAR(filled(2, 0), by_regression[0], 1e-12);
  // In the middle, between rows that are there: S_22 - S_2O S_OO^-1 S_O2 by hand.
  data << 1.5, 0, kMissing, 8, 2, 9;
  const Eigen::Matrix2d there = (Eigen::Matrix2d() << 2, -1, -1, 4).finished();
  const Eigen::Vector2d gain = there.lu().solve(Eigen::Vector2d(.5, .3));
  const Completed filled_in = completed(component, data, Eigen::Vector2d(3, 1));
  EXPECT_NEAR(filled_in.data(1, 0), 2 + gain.dot(Eigen::Vector2d(.5, -1)), 1e-12);
  const Eigen::MatrixXd& left = filled_in.left;
  EXPECT_NEAR(left(1, 1), .75 * (1 - gain.dot(Eigen::Vector2d(.5, .3))), 1e-12);
  EXPECT_EQ((left - left(1, 1) * Eigen::Vector3d::Unit(1) * Eigen::RowVector3d::Unit(1)).norm(), 0);
}

TEST(MissingOutputsTest, ASampleCountsByTheDensityOfWhatItHas) {
  const Component component = gaussian();
  Eigen::MatrixXd sample = Eigen::Vector3d(1.5, kMissing, 2);
  Component there = marginal(component, {0, 2});
  there.prior = 1;
  Component whole = component;
  whole.prior = 1;
  EXPECT_DOUBLE_EQ(mean_log_likelihood(Gmm(1, {whole}), sample),
                   mean_log_likelihood(Gmm(1, {there}), Eigen::Vector2d(1.5, 2)));
}

/// The law of EM: without regularisation no iteration makes the data less likely.
TEST(MissingOutputsTest, TheLikelihoodOfWhatIsThereNeverFalls) {
  Eigen::MatrixXd data = two_outputs(120);
  for (int n = 0; n < 120; n += 3) data(1 + n % 2, n) = kMissing;
  Gmm gmm = equally_spaced(data, 1, 3, 2);
  const EmSettings one_step{.num_iterations = 1, .regularisation = Eigen::Vector3d::Zero()};
  double before = mean_log_likelihood(gmm, data);
  for (int i = 0; i < 40; ++i) {
    gmm = fit_em(gmm, data, one_step);
    const double now = mean_log_likelihood(gmm, data);
    ASSERT_GE(now, before - 1e-10) << "iteration " << i;
    before = now;
  }
}

/// A component that has never seen an output would keep whatever it began with.
TEST(MissingOutputsTest, AComponentWithoutAnySampleOfAnOutputIsAnError) {
  Eigen::MatrixXd data = two_outputs(300);
  for (int n = 90; n < 210; ++n) data(2, n) = kMissing;
  const EmSettings em{.num_iterations = 300, .regularisation = Eigen::Vector3d(1e-4, 1e-4, 1e-4)};
  try {
    (void)fit_em(equally_spaced(data, 1, 6, 2), data, em);
    FAIL() << "a component lies where the output is missing";
  } catch (const FitError& error) {
    EXPECT_NE(std::string(error.what()).find("output 2 is missing"), std::string::npos)
        << error.what();
  }
}

/// A sensor that drops two samples of three for a while costs the fit next to nothing.
TEST(MissingOutputsTest, AFitKnowsWhatTheOtherSamplesAndOutputsTell) {
  const Eigen::MatrixXd whole = two_outputs(300);
  Eigen::MatrixXd data = whole;
  for (int n = 60; n < 240; ++n) {
    if (n % 3 != 0) data(2, n) = kMissing;
  }
  const EmSettings em{.num_iterations = 300, .regularisation = Eigen::Vector3d(1e-4, 1e-4, 1e-4)};
  const Gmr fitted(fit_em(equally_spaced(data, 1, 5, 2), data, em));
  const Gmr of_whole(fit_em(equally_spaced(whole, 1, 5, 2), whole, em));
  double worst = 0;
  for (int n = 0; n < 300; ++n) {
    const Eigen::VectorXd input = whole.col(n).head(1);
    worst = std::max(worst, (fitted.regress(input) - of_whole.regress(input)).cwiseAbs()[1]);
  }
  EXPECT_LT(worst, .15);  // of a range of 4
}

TEST(MissingOutputsTest, ARefinementLooksAtWhatIsThere) {
  Eigen::MatrixXd data = two_outputs(200);
  for (int n = 0; n < 200; n += 4) data(1, n) = kMissing;
  for (int n = 60; n < 90; ++n) data(2, n) = kMissing;
  const EmSettings em{.num_iterations = 100, .regularisation = Eigen::Vector3d(1e-4, 1e-4, 1e-4)};
  const Gmm fitted = fit_em(equally_spaced(data, 1, 4, 2), data, em);
  const double before = relative_regression_error(fitted, data);
  const double after = relative_regression_error(refine_regression(fitted, data, {}), data);
  EXPECT_TRUE(std::isfinite(before));
  EXPECT_LT(after, before);
  EXPECT_LT(after, .1);
}

}  // namespace
}  // namespace treeroll
