#include "common/mixture/gmr.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "common/mixture/gmr_lanes.h"
#include "common/numbers/processor.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// and as they stand, with inverses, determinants and std::exp.
VectorXd textbook(const Gmm& gmm, const VectorXd& x) {
  const int in = gmm.input_dim();
  const int out = gmm.output_dim();
  double sum = 0;
  VectorXd mean = VectorXd::Zero(out);
  for (const Component& c : gmm.components()) {
    const MatrixXd inverse = c.covariance.topLeftCorner(in, in).inverse();
    const VectorXd offset = x - c.mean.head(in);
    const double density =
        c.prior * std::exp(-.5 * offset.dot(inverse * offset)) /
        std::sqrt(std::pow(2 * M_PI, in) * c.covariance.topLeftCorner(in, in).determinant());
    mean +=
        density * (c.mean.tail(out) + c.covariance.bottomLeftCorner(out, in) * inverse * offset);
    sum += density;
  }
  return mean / sum;
}

TEST(GmrTest, AgreesWithTheTextbookFormula) {
  for (std::uint32_t number = 0; number < 20; ++number) {
    test::RandomMixture random(number);
    for (const auto& [in, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {3, 5}}) {
      const Gmm gmm = random.gmm(in, dim, 4);
      const Gmr gmr(gmm);
      for (int i = 0; i < 10; ++i) {
        const VectorXd x = 2 * random.vector(in);
        EXPECT_LT((gmr.regress(x) - textbook(gmm, x)).norm(), 1e-10) << "mixture " << number;
        EXPECT_NEAR(gmr.weights(x).sum(), 1, 1e-14);
      }
    }
  }
}

TEST(GmrTest, IsALineForOneComponent) {
  test::RandomMixture random(3);
  const Gmm gmm = random.gmm(1, 2, 1);
  const Gmr gmr(gmm);
  const Component& c = gmm[0];
  const double slope = c.covariance(1, 0) / c.covariance(0, 0);
  for (const double x : {-40., -1., 0., 2.5, 1e6}) {
    EXPECT_NEAR(gmr.regress(x), c.mean[1] + slope * (x - c.mean[0]), 1e-12 * (1 + std::abs(x)));
  }
}

TEST(GmrTest, IsLinearForOneComponentInAnyDimensions) {
  // Affine: along any line from x to y the output goes in proportion. And through the mean.
  for (std::uint32_t number = 0; number < 20; ++number) {
    test::RandomMixture random(number);
    for (const auto& [in, dim] : {std::pair{1, 2}, {1, 4}, {2, 3}, {3, 5}}) {
      const Gmm gmm = random.gmm(in, dim, 1);
      const Gmr gmr(gmm);
      const VectorXd x = random.vector(in), y = 100 * random.vector(in);
      for (const double part : {-2., .3, 7.}) {
        const VectorXd between = gmr.regress(x + part * (y - x));
        const VectorXd expected = gmr.regress(x) + part * (gmr.regress(y) - gmr.regress(x));
        EXPECT_LT((between - expected).norm(), 1e-10 * (1 + expected.norm())) << number;
      }
      EXPECT_EQ(gmr.regress(gmm[0].mean.head(in)), gmm[0].mean.tail(dim - in));
    }
  }
}

TEST(GmrTest, GivesTheSameBitsForANumberAndAVectorOfOne) {
  test::RandomMixture random(4);
  const Gmr gmr(random.gmm(1, 2, 5));
  for (int i = 0; i < 50; ++i) {
    const double x = 5 * random.normal();
    EXPECT_EQ(gmr.regress(x), gmr.regress(VectorXd::Constant(1, x))[0]);
  }
}

TEST(GmrTest, LetsTheNearestComponentDecideFarFromAllOfThem) {
  const MatrixXd unit = MatrixXd::Identity(2, 2);
  const Gmr gmr(Gmm(1, {{.5, Eigen::Vector2d(-1, 3), unit}, {.5, Eigen::Vector2d(1, 7), unit}}));
  EXPECT_EQ(gmr.regress(-1e6), 3);
  EXPECT_EQ(gmr.regress(1e6), 7);
  EXPECT_EQ(gmr.weights(VectorXd::Constant(1, 1e6)), Eigen::Vector2d(0, 1));
}

TEST(GmrTest, IsFiniteForEveryFiniteInput) {
  for (std::uint32_t number = 0; number < 5; ++number) {
    test::RandomMixture random(number);
    const Gmr line(random.gmm(1, 2, 3));
    const Gmr plane(random.gmm(2, 4, 3));
    for (double x = 1; std::isfinite(x); x *= 1e20) {
      EXPECT_TRUE(std::isfinite(line.regress(x)) && std::isfinite(line.regress(-x))) << x;
      EXPECT_TRUE(plane.regress(Eigen::Vector2d(x, -x)).allFinite()) << x;
      EXPECT_NEAR(plane.weights(Eigen::Vector2d(-x, x)).sum(), 1, 1e-14) << x;
    }
  }
}

TEST(GmrTest, LeavesOutAComponentWithoutWeight) {
  std::vector<Component> components = test::RandomMixture(6).gmm(1, 2, 3).components();
  components[1].prior = 0;
  const Gmr with(Gmm(1, components));
  EXPECT_EQ(with.weights(VectorXd::Constant(1, .3))[1], 0);
  components.erase(components.begin() + 1);
  EXPECT_EQ(with.regress(.3), Gmr(Gmm(1, components)).regress(.3));
}

TEST(GmrTest, DoesNotNeedPriorsThatSumToOne) {
  std::vector<Component> components = test::RandomMixture(8).gmm(1, 2, 3).components();
  const double before = Gmr(Gmm(1, components)).regress(.3);
  for (Component& component : components) component.prior *= 17;
  EXPECT_NEAR(Gmr(Gmm(1, components)).regress(.3), before, 1e-13);
}

TEST(GmrTest, GivesTheMomentsOfTheDensityOfTheOutputAtAnInput) {
  // An independent way to and the exact: the joint density summed over the
  // output on a fine grid.
  for (std::uint32_t number = 0; number < 10; ++number) {
    test::RandomMixture random(number);
    const Gmm gmm = random.gmm(1, 2, 3);
    const Gmr gmr(gmm);
    const VectorXd x = random.vector(1);
    double sum = 0, first = 0, second = 0;
    for (double y = -60; y <= 60; y += .01) {
      double density = 0;
      for (const Component& c : gmm.components()) {
        const VectorXd offset = Eigen::Vector2d(x[0], y) - c.mean;
        density += c.prior * std::exp(-.5 * offset.dot(c.covariance.inverse() * offset)) /
                   std::sqrt(c.covariance.determinant());
      }
      sum += density;
      first += density * y;
      second += density * y * y;
    }
    const double mean = first / sum;
    EXPECT_NEAR(gmr.regress(x)[0], mean, 1e-9) << number;
    EXPECT_NEAR(gmr.variance(x, VarianceKind::kTotal)(0, 0), second / sum - mean * mean, 1e-9)
        << number;
  }
}

TEST(GmrTest, GivesTheConditionalVarianceForOneComponentWhicheverIsAskedFor) {
  for (const auto& [in, dim] : {std::pair{1, 2}, {1, 3}, {2, 3}, {3, 5}}) {
    test::RandomMixture random(9);
    const Gmm gmm = random.gmm(in, dim, 1);
    // the inverse of the block of the outputs of the inverse.
    const MatrixXd inverse = gmm[0].covariance.inverse();
    const MatrixXd expected = inverse.bottomRightCorner(dim - in, dim - in).inverse();
    for (const VarianceKind kind : {VarianceKind::kTotal, VarianceKind::kAsPrinted}) {
      EXPECT_LT((Gmr(gmm).variance(random.vector(in), kind) - expected).norm(), 1e-12);
    }
  }
}

TEST(GmrTest, GivesTheTotalVarianceOfTheOutputs) {
  // Where two equal components stand apart in the output, their distance is part of the variance;
  // the printed does not see it.
  const MatrixXd unit = MatrixXd::Identity(2, 2);
  const Gmr gmr(Gmm(1, {{.5, Eigen::Vector2d(0, -3), unit}, {.5, Eigen::Vector2d(0, 3), unit}}));
  const VectorXd x = VectorXd::Zero(1);
  EXPECT_NEAR(gmr.variance(x, VarianceKind::kTotal)(0, 0), 10, 1e-14);
  EXPECT_NEAR(gmr.variance(x, VarianceKind::kAsPrinted)(0, 0), .5, 1e-14);
}

/// Every width that this processor has, full and not, beside whoever.
TEST(GmrTest, GivesTheSameBitsForManyInputsAtATime) {
  for (std::uint32_t number = 0; number < 10; ++number) {
    test::RandomMixture random(number);
    for (const auto& [in, dim, components] :
         {std::tuple{1, 2, 1}, {1, 2, 5}, {1, 3, 4}, {1, 8, 2}, {2, 3, 3}}) {
      const Gmr gmr(random.gmm(in, dim, components));
      Gmr::WorkSpace work = gmr.work_space();
      for (int count = 0; count < 20; ++count) {
        const VectorXd inputs = 100 * random.vector(count * in);
        VectorXd together(count * (dim - in));
        gmr.regress_all({inputs.data(), static_cast<std::size_t>(inputs.size())}, work,
                        {together.data(), static_cast<std::size_t>(together.size())});
        for (int i = 0; i < count; ++i) {
          EXPECT_EQ(together.segment(i * (dim - in), dim - in),
                    gmr.regress(inputs.segment(i * in, in)));
        }
      }
    }
  }
}

TEST(GmrTest, GivesTheSameBitsInEveryWidth) {
  const std::pair<int, GmrLanes> widths[] = {
      {2, &gmr_regress_2}, {4, &gmr_regress_4}, {8, &gmr_regress_8}};
  const double mean_input[] = {-1, .5, 2}, precision[] = {2, .7, 3}, log_weight[] = {-1, 0, -2};
  const double slope[] = {1, -2, .3, 4, 0, -1}, mean_output[] = {0, 1, -5, 2, 7, .1};
  const gmr_kernel::Lines lines = {3, 2, mean_input, precision, log_weight, slope, mean_output};
  std::array<double, 8> inputs{};
  std::array<double, 16> expected{};
  std::array<double, 24> weights{};
  for (std::size_t i = 0; i < 8; ++i) {
    inputs[i] = static_cast<double>(i) * .77 - 2;
    gmr_kernel::regress(lines, inputs[i], weights.data(), [&](int o, double output) {
      expected[2 * i + static_cast<std::size_t>(o)] = output;
    });
  }
  for (const auto& [width, regress] : widths) {
    if (width > widest_lanes()) continue;
    std::array<double, 16> outputs{};
    regress(lines, inputs.data(), weights.data(), outputs.data());
    const auto size = static_cast<std::size_t>(2 * width);
    EXPECT_TRUE(std::equal(outputs.begin(), outputs.begin() + size, expected.begin())) << width;
  }
}

}  // namespace
}  // namespace treeroll
