#include "learner/fit/kmeans.h"

#include <gtest/gtest.h>

#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

/// Three heaps of five observations about (0, 0), (10, 500) and (20, -500).
Eigen::MatrixXd heaps() {
  Eigen::MatrixXd data(2, 15);
  const double offsets[5][2] = {{0, 0}, {1, 0}, {-1, 0}, {0, 20}, {0, -20}};
  const double centres[3][2] = {{20, -500}, {0, 0}, {10, 500}};
  for (int n = 0; n < 15; ++n) {
    for (int i = 0; i < 2; ++i) data(i, n) = centres[n % 3][i] + offsets[n / 3][i];
  }
  return data;
}

const Eigen::Vector2d kRegularisation(.5, 3);

TEST(KmeansTest, FindsHeapsAndTheirMomentsWhateverTheSeed) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Gmm gmm = kmeans(heaps(), 1, 3, seed, kRegularisation);
    const double centres[3][2] = {{0, 0}, {10, 500}, {20, -500}};
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(gmm[k].prior, 1. / 3, 1e-15);
      EXPECT_NEAR(gmm[k].mean[0], centres[k][0], 1e-12) << seed;
      EXPECT_NEAR(gmm[k].mean[1], centres[k][1], 1e-12) << seed;
      EXPECT_NEAR(gmm[k].covariance(0, 0), .4 + .5, 1e-12);
      EXPECT_NEAR(gmm[k].covariance(1, 1), 160 + 3, 1e-10);
      EXPECT_NEAR(gmm[k].covariance(1, 0), 0, 1e-10);
    }
  }
}

TEST(KmeansTest, IsAFunctionOfItsSeedAndNotOfTheUnitsOfARow) {
  test::RandomMixture random(1);
  Eigen::MatrixXd data = Eigen::MatrixXd::NullaryExpr(2, 60, [&] { return random.normal(); });
  const Gmm first = kmeans(data, 1, 5, 3, kRegularisation);
  EXPECT_EQ(test::distance(kmeans(data, 1, 5, 3, kRegularisation), first), 0);
  data.row(1) *= 1024;  // exact in binary
  const Gmm scaled = kmeans(data, 1, 5, 3, kRegularisation);
  for (int k = 0; k < 5; ++k) {
    EXPECT_NEAR(scaled[k].mean[0], first[k].mean[0], 1e-12);
    EXPECT_NEAR(scaled[k].mean[1], 1024 * first[k].mean[1], 1e-9);
  }
}

TEST(KmeansTest, LeavesNoObservationNearerToAnotherCentre) {
  test::RandomMixture random(2);
  Eigen::MatrixXd data = Eigen::MatrixXd::NullaryExpr(1, 200, [&] { return random.normal(); });
  data.conservativeResize(2, Eigen::NoChange);
  data.row(1) = data.row(0);  // On a line the clusters are intervals, met half-way.
  const Gmm gmm = kmeans(data, 1, 4, 1, kRegularisation);
  double prior_sum = 0;
  for (int k = 0; k < 4; ++k) {
    double sum = 0, count = 0;
    for (int n = 0; n < 200; ++n) {
      const double x = data(0, n);
      const bool above = k == 0 || x > (gmm[k - 1].mean[0] + gmm[k].mean[0]) / 2;
      const bool below = k == 3 || x < (gmm[k].mean[0] + gmm[k + 1].mean[0]) / 2;
      if (above && below) {
        sum += x;
        ++count;
      }
    }
    EXPECT_NEAR(gmm[k].mean[0], sum / count, 1e-12);
    EXPECT_NEAR(gmm[k].prior, count / 200, 1e-12);
    prior_sum += gmm[k].prior;
  }
  EXPECT_NEAR(prior_sum, 1, 1e-14);
}

TEST(KmeansTest, RefusesDataWithTooFewDifferentObservationsOrNone) {
  Eigen::MatrixXd data(2, 4);
  data << 1, 2, 1, 2, 3, 4, 3, 4;
  EXPECT_NO_THROW(kmeans(data, 1, 2, 1, kRegularisation));
  EXPECT_THROW(kmeans(data, 1, 3, 1, kRegularisation), FitError);
  // An output that does not vary needs a variance of its own; an input must vary.
  data.row(1).setConstant(.1);
  EXPECT_NO_THROW(kmeans(data, 1, 2, 1, kRegularisation));
  EXPECT_THROW(kmeans(data, 1, 2, 1, Eigen::Vector2d(1e-3, 0)), FitError);
  EXPECT_THROW(kmeans(data.colwise().reverse(), 1, 2, 1, kRegularisation), FitError);
}

}  // namespace
}  // namespace treeroll
