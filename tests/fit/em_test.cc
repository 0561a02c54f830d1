#include "learner/fit/em.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "common/policy/tree/frame.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

/// Draws from a mixture whose priors sum to one, component after component.
MatrixXd draws(const Gmm& gmm, int num_samples, test::RandomMixture& random) {
  MatrixXd data(gmm.dim(), num_samples);
  int n = 0;
  for (int k = 0; k < gmm.num_components(); ++k) {
    const MatrixXd factor = cholesky_factor(gmm[k].covariance);
    const int last = k + 1 == gmm.num_components()
                         ? num_samples
                         : n + static_cast<int>(std::lround(gmm[k].prior * num_samples));
    for (; n < last; ++n) data.col(n) = gmm[k].mean + factor * random.vector(gmm.dim());
  }
  return data;
}

EmSettings settings(int num_iterations, int dim = 2, double regularisation = 0) {
  return {num_iterations, VectorXd::Constant(dim, regularisation)};
}

TEST(EmTest, ReportsTheLogLikelihoodOfTheTextbook) {
  test::RandomMixture random(1);
  const Gmm gmm = random.gmm(1, 3, 3);
  const MatrixXd data = MatrixXd::NullaryExpr(3, 20, [&] { return 2 * random.normal(); });
  double sum = 0;
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    double density = 0;
    for (const Component& c : gmm.components()) {
      const VectorXd offset = data.col(n) - c.mean;
      density += c.prior * std::exp(-.5 * offset.dot(c.covariance.inverse() * offset)) /
                 std::sqrt(std::pow(2 * M_PI, 3) * c.covariance.determinant());
    }
    sum += std::log(density);
  }
  EXPECT_NEAR(mean_log_likelihood(gmm, data), sum / 20, 1e-12);
}

TEST(EmTest, NeverLowersTheLikelihood) {
  for (std::uint32_t number = 0; number < 10; ++number) {
    for (const int dim : {2, 3, 4}) {
      test::RandomMixture random(number);
      const MatrixXd data = MatrixXd::NullaryExpr(dim, 150, [&] { return random.normal(); });
      // Fewer components in more dimensions: without regularisation the outer ones collapse.
      Gmm gmm = equally_spaced(data, 1, dim == 2 ? 4 : 2, 1);
      double before = mean_log_likelihood(gmm, data);
      for (int i = 0; i < 60; ++i) {
        gmm = fit_em(gmm, data, settings(1, dim));
        const double after = mean_log_likelihood(gmm, data);
        EXPECT_GE(after, before - 1e-13)
            << "data " << number << ", d " << dim << ", iteration " << i;
        before = after;
      }
    }
  }
}

TEST(EmTest, RecoversTheMixtureTheDataWereDrawnFrom) {
  MatrixXd tilted(2, 2);
  tilted << .5, .3, .3, .4;
  const Gmm truth(1, {{.4, Vector2d(0, 1), tilted}, {.6, Vector2d(4, -2), .3 * tilted}});
  test::RandomMixture random(2);
  const MatrixXd data = draws(truth, 20000, random);
  const Gmm fit = fit_em(equally_spaced(data, 1, 2, 2), data, settings(200));
  EXPECT_LT(test::distance(fit, truth), .03);
}

TEST(EmTest, GivesTheMomentsOfTheDataForOneComponent) {
  test::RandomMixture random(3);
  const MatrixXd data = MatrixXd::NullaryExpr(3, 40, [&] { return random.normal(); });
  const Gmm fit = fit_em(random.gmm(1, 3, 1), data, settings(1, 3, .25));
  const VectorXd mean = data.rowwise().mean();
  const MatrixXd centred = data.colwise() - mean;
  EXPECT_NEAR(fit[0].prior, 1, 1e-15);
  EXPECT_LT((fit[0].mean - mean).norm(), 1e-14);
  const MatrixXd regularised = centred * centred.transpose() / 40 + .25 * MatrixXd::Identity(3, 3);
  EXPECT_LT((fit[0].covariance - regularised).norm(), 1e-13);
}

TEST(EmTest, FitsChildrenToTheDataTheirParentIsResponsibleForAndNoOthers) {
  test::RandomMixture random(4);
  const MatrixXd data = MatrixXd::NullaryExpr(2, 120, [&] { return random.normal(); });
  VectorXd responsibility = VectorXd::Zero(120);
  responsibility.head(80).setOnes();
  const Gmm start = equally_spaced(data, 1, 2, 1);
  const Gmm children = fit_children(start, data, responsibility, settings(30));
  const Gmm alone = fit_em(start, data.leftCols(80), settings(30));
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT((children[k].mean - alone[k].mean).norm(), 1e-12);
    EXPECT_LT((children[k].covariance - alone[k].covariance).norm(), 1e-12);
    EXPECT_NEAR(children[k].prior, alone[k].prior * 80 / 120, 1e-13);
  }
}

TEST(EmTest, GivesResponsibilitiesThatSumToOneEvenFarOut) {
  test::RandomMixture random(5);
  const Gmm gmm = random.gmm(1, 2, 4);
  MatrixXd data(2, 3);
  data << 0, 1e4, -1e8, 1, -1e4, 1e8;
  const MatrixXd h = responsibilities(gmm, data);
  for (Eigen::Index n = 0; n < 3; ++n) EXPECT_NEAR(h.col(n).sum(), 1, 1e-14);
}

TEST(EmTest, SpacesItsStartEquallyOverTheFirstInput) {
  MatrixXd data(2, 3);
  data << 1, 3, 2, 7, 8, 9;
  const Gmm start = equally_spaced(data, 1, 4, 5);
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(start[k].mean, Vector2d(1 + (k + .5) * .5, 0));
    EXPECT_EQ(start[k].covariance, MatrixXd(Vector2d(.0625, 25).asDiagonal()));
    EXPECT_EQ(start[k].prior, .25);
  }
  EXPECT_THROW(equally_spaced(MatrixXd::Ones(2, 5), 1, 2, 1), FitError);
}

std::string refusal_of_fit(const Gmm& start, const MatrixXd& data) {
  try {
    fit_em(start, data, settings(50));
  } catch (const FitError& error) {
    return error.what();
  }
  return "";
}

TEST(EmTest, AnOffsetOfTheOutputChangesNothingButTheOffset) {
  const Eigen::Index num_samples = 100;
  MatrixXd data(2, num_samples);
  for (Eigen::Index n = 0; n < num_samples; ++n) {
    const double time = static_cast<double>(n) / 50;
    data.col(n) = Vector2d(time, std::sin(3 * time));
  }
  const Gmm near = fit_em(equally_spaced(data, 1, 4, .7), data, settings(50, 2, 1e-4));
  for (const double offset : {1e3, -1e6, 1e8}) {
    MatrixXd far = data;
    far.row(1).array() += offset;
    const Gmm fit = fit_em(equally_spaced(far, 1, 4, .7), far, settings(50, 2, 1e-4));
    for (int k = 0; k < 4; ++k) {
      EXPECT_LT((fit[k].mean - Vector2d(0, offset) - near[k].mean).norm(), 1e-6) << offset;
      EXPECT_LT((fit[k].covariance - near[k].covariance).norm(), 1e-6) << offset;
    }
  }
}

TEST(EmTest, SaysSoWhenAComponentCollapses) {
  const MatrixXd unit = MatrixXd::Identity(2, 2);
  test::RandomMixture random(6);
  const MatrixXd cloud = MatrixXd::NullaryExpr(2, 50, [&] { return random.normal(); });
  EXPECT_THAT(
      refusal_of_fit(Gmm(1, {{.5, Vector2d(0, 0), unit}, {.5, Vector2d(1e6, 0), unit}}), cloud),
      HasSubstr("component 1 of 2 is left without data in iteration 1"));
  // All data on a line, and nothing added to the covariance.
  const MatrixXd line = VectorXd::LinSpaced(50, 0, 1).transpose().replicate(2, 1);
  EXPECT_THAT(refusal_of_fit(Gmm(1, {{1, Vector2d(0, 0), unit}}), line),
              HasSubstr("component 0: the covariance must be positive definite"));
}

}  // namespace
}  // namespace treeroll
