#include "common/mixture/gmm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

std::string refusal(int input_dim, const std::function<void(std::vector<Component>&)>& spoil) {
  std::vector<Component> components = test::RandomMixture(1).gmm(1, 3, 3).components();
  spoil(components);
  try {
    const Gmm gmm(input_dim, components);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(GmmTest, KeepsWhatItIsGiven) {
  const Gmm gmm = test::RandomMixture(1).gmm(1, 3, 4);
  EXPECT_EQ(gmm.input_dim(), 1);
  EXPECT_EQ(gmm.output_dim(), 2);
  EXPECT_EQ(gmm.num_components(), 4);
  EXPECT_EQ(test::distance(gmm, Gmm(1, gmm.components())), 0);
}

TEST(GmmTest, RefusesWhatIsNoMixtureNamingComponentAndRule) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Components = std::vector<Component>;
  EXPECT_EQ(refusal(1, [](Components&) {}), "");
  EXPECT_THAT(refusal(1, [](Components& c) { c.clear(); }), HasSubstr("at least one component"));
  EXPECT_THAT(refusal(0, [](Components&) {}), HasSubstr("number of inputs is 0"));
  EXPECT_THAT(refusal(3, [](Components&) {}), HasSubstr("number of inputs is 3"));
  EXPECT_THAT(refusal(1, [](Components& c) { c[1].mean.conservativeResize(2); }),
              HasSubstr("component 1: the mean has 2 elements, must have 3"));
  EXPECT_THAT(refusal(1, [](Components& c) { c[2].covariance.resize(2, 3); }),
              HasSubstr("component 2: the covariance is 2 x 3"));
  EXPECT_THAT(refusal(1, [=](Components& c) { c[1].mean[2] = kNan; }),
              HasSubstr("component 1: element 2 of the mean is nan"));
  EXPECT_THAT(refusal(1, [](Components& c) { c[1].mean[2] = 1e51; }), HasSubstr("at most 1e+50"));
  EXPECT_THAT(refusal(1, [](Components& c) { c[0].prior = -.1; }), HasSubstr("prior is -0.1"));
  EXPECT_THAT(refusal(1, [=](Components& c) { c[0].prior = kNan; }), HasSubstr("prior is nan"));
  EXPECT_THAT(refusal(1,
                      [](Components& c) {
                        for (Component& component : c) component.prior = 0;
                      }),
              HasSubstr("at least one prior"));
  EXPECT_THAT(refusal(1, [](Components& c) { c[0].covariance(1, 1) = -1; }),
              HasSubstr("component 0: variance 1 is -1"));
  EXPECT_THAT(refusal(1, [=](Components& c) { c[0].covariance(2, 1) = kNan; }),
              HasSubstr("must be symmetric"));
  EXPECT_THAT(refusal(1, [](Components& c) { c[0].covariance(2, 1) += .01; }),
              HasSubstr("must be symmetric"));
  EXPECT_THAT(refusal(1,
                      [](Components& c) {
                        c[2].covariance.setConstant(.5);
                        c[2].covariance.diagonal().setConstant(.4);
                      }),
              HasSubstr("component 2: the covariance must be positive definite"));
}

TEST(GmmTest, MakesACovarianceThatIsSymmetricUpToRoundingExactlySo) {
  std::vector<Component> components = test::RandomMixture(2).gmm(1, 3, 1).components();
  components[0].covariance(0, 2) *= 1 + 1e-15;
  const Gmm gmm(1, components);
  EXPECT_EQ(gmm[0].covariance, Eigen::MatrixXd(gmm[0].covariance.transpose()));
}

}  // namespace
}  // namespace treeroll
