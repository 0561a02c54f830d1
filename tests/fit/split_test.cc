#include "learner/fit/split.h"

#include <gtest/gtest.h>

#include "common/policy/tree/frame.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Moments {
  double zeroth;
  VectorXd first;
  MatrixXd second;
};

Moments moments(const std::vector<Component>& components) {
  const Eigen::Index dim = components[0].mean.size();
  Moments sum{0, VectorXd::Zero(dim), MatrixXd::Zero(dim, dim)};
  for (const Component& c : components) {
    sum.zeroth += c.prior;
    sum.first += c.prior * c.mean;
    sum.second += c.prior * (c.covariance + c.mean * c.mean.transpose());
  }
  return sum;
}

void expect_equal(const Moments& a, const Moments& b) {
  EXPECT_NEAR(a.zeroth, b.zeroth, 1e-14);
  EXPECT_LT((a.first - b.first).norm(), 1e-12);
  EXPECT_LT((a.second - b.second).norm(), 1e-11);
}

TEST(SplitTest, KeepsTheMomentsOfOrderZeroOneAndTwoAndAMixture) {
  for (const SplitAxis axis : {SplitAxis::kCholesky, SplitAxis::kPrincipal}) {
    for (const int dim : {2, 3, 5}) {
      test::RandomMixture random(static_cast<std::uint32_t>(dim));
      for (const double alpha : {.1, .5, .8}) {
        for (const double beta : {.2, .5, .9}) {
          for (const double u : {.1, .5, .9}) {
            const Component parent = random.component(dim);
            const auto [j, k] = split(parent, {axis, alpha, beta, u});
            expect_equal(moments({j, k}), moments({parent}));
            EXPECT_NEAR(j.prior, alpha * parent.prior, 1e-15);
            EXPECT_NO_THROW(Gmm(1, {j, k})) << alpha << " " << beta << " " << u;
          }
        }
      }
    }
  }
}

TEST(SplitTest, PlacesTheMeansAlongTheChosenAxis) {
  const Component parent = test::RandomMixture(4).component(2);
  const VectorXd column = cholesky_factor(parent.covariance).col(0);
  const auto [before, after] = split(parent, {});
  EXPECT_LT((after.mean - before.mean - column).norm(), 1e-13);
  EXPECT_LT((before.covariance - after.covariance).norm(), 1e-13);

  SplitSettings principal;
  principal.axis = SplitAxis::kPrincipal;
  const auto [low, high] = split(parent, principal);
  const VectorXd apart = high.mean - low.mean;
  EXPECT_LT((parent.covariance * apart - apart.squaredNorm() * apart).norm(), 1e-11)
      << "an eigenvector as long as the deviation along it";
}

TEST(MergeTest, KeepsTheMomentsOfOrderZeroOneAndTwo) {
  for (std::uint32_t number = 0; number < 20; ++number) {
    test::RandomMixture random(number);
    const Component first = random.component(3);
    const Component second = random.component(3);
    expect_equal(moments({merge(first, second)}), moments({first, second}));
  }
}

TEST(MergeTest, UndoesASplit) {
  const Component parent = test::RandomMixture(9).component(3);
  const auto [first, second] = split(parent, {.alpha = .3});
  expect_equal(moments({merge(first, second)}), moments({parent}));
}

}  // namespace
}  // namespace treeroll
