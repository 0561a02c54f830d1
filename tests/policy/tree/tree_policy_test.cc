#include "common/policy/tree/tree_policy.h"

#include <gtest/gtest.h>

#include "tests/mixture/random_mixture.h"
#include "tests/policy/tree/every_layout.h"

namespace treeroll {
namespace {

TEST(TreePolicyTest, DecodesItsOwnThetaToItsFinestLayer) {
  for (const FrameKind kind : kFrameKinds) {
    for (const ThetaLayout layout : kLayouts) {
      for (int layer = 1; layer <= 3; ++layer) {
        const TreePolicy policy{test::RandomMixture(21).tree(kind, 1, 3, 3), layer, layout};
        EXPECT_EQ(policy.theta().size(), policy.theta_dim());
        EXPECT_LT(test::distance(policy.decode(policy.theta()), policy.tree().finest()), 1e-9);
      }
    }
  }
}

TEST(TreePolicyTest, GivesBackTheThetaThatWasPutIn) {
  for (const FrameKind kind : kFrameKinds) {
    for (const ThetaLayout layout : kLayouts) {
      for (int layer = 1; layer <= 3; ++layer) {
        test::RandomMixture random(22);
        TreePolicy policy{random.tree(kind, 1, 2, 3), layer, layout};
        const Eigen::VectorXd theta = policy.theta() + .1 * random.vector(policy.theta_dim());
        policy = TreePolicy(policy.tree_with(theta), layer, layout);
        EXPECT_LT((policy.theta() - theta).norm(), 1e-10);
      }
    }
  }
}

}  // namespace
}  // namespace treeroll
