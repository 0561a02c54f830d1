#include "common/policy/network/network_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/policy/kinds/standard_policies.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

/// Two inputs, three hidden units, two outputs.
NetworkPolicy example_network() {
  test::RandomMixture random(4);
  Network network{.ranges = {{-1, 3}, {10, 20}},
                  .outer = Eigen::MatrixXd(2, 4),
                  .inner = Eigen::MatrixXd(3, 3)};
  for (double& number : network.outer.reshaped()) number = random.vector(1)[0];
  for (double& number : network.inner.reshaped()) number = random.vector(1)[0];
  return NetworkPolicy(network);
}

Eigen::Vector2d act_network(const Policy& policy, double first, double second) {
  const double input[] = {first, second};
  Eigen::Vector2d output;
  policy.controller()->act(input, {output.data(), 2});
  return output;
}

TEST(NetworkPolicyTest, AddsUpWhatItsUnitsMakeOfScaledInputs) {
  const NetworkPolicy policy = example_network();
  const Network& network = policy.network();
  Eigen::Vector3d scaled(2 * (2. + 1) / 4 - 1, 2 * (13. - 10) / 10 - 1, 1);
  Eigen::Vector4d hidden;
  hidden << (network.inner * scaled).array().unaryExpr([](double x) { return std::tanh(x); }), 1;
  EXPECT_LT((act_network(policy, 2, 13) - network.outer * hidden).norm(), 1e-14);
}

TEST(NetworkPolicyTest, RoundTripsThroughItsTextToTheBit) {
  const NetworkPolicy policy = example_network();
  const Result<PolicyPtr> copy = standard_policies().from_json(to_json(policy));
  ASSERT_TRUE(copy) << copy.error().message;
  EXPECT_EQ(to_json(**copy), to_json(policy));
  EXPECT_EQ((*copy)->theta(), policy.theta());
  EXPECT_EQ(act_network(**copy, .3, 17), act_network(policy, .3, 17));
}

TEST(NetworkPolicyTest, ThetaIsWhatItWasMadeWith) {
  const NetworkPolicy policy = example_network();
  const Eigen::VectorXd theta = test::RandomMixture(5).vector(policy.theta_dim());
  EXPECT_EQ(policy.theta_dim(), 17);
  EXPECT_EQ(policy.with(theta)->theta(), theta);
  EXPECT_EQ(to_json(*policy.with(policy.theta())), to_json(policy));
}

/// The derivative that fits and metrics go by, against differences.
TEST(NetworkPolicyTest, ItsEffectIsTheDerivativeOfItsOutputs) {
  const NetworkPolicy policy = example_network();
  const PolicyEffect effect = policy.effect();
  EXPECT_EQ(effect.outputs.rows(), 512);
  for (int i = 0; i < policy.theta_dim(); ++i) {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd ahead = policy.theta(), behind = policy.theta();
    ahead[i] += kStep;
    behind[i] -= kStep;
    const Eigen::MatrixXd difference =
        (policy.with(ahead)->effect().outputs - policy.with(behind)->effect().outputs) /
        (2 * kStep);
    EXPECT_LT((difference.transpose().reshaped() - effect.derivative.col(i)).cwiseAbs().maxCoeff(),
              1e-8)
        << i;
    EXPECT_NEAR(policy.steps_of_equal_effect()[i],
                1 / std::sqrt(effect.derivative.col(i).squaredNorm() / 512), 1e-9);
  }
}

TEST(NetworkPolicyTest, WhatMovesNothingIsBounded) {
  Network silent = example_network().network();
  silent.outer.setZero();
  const NetworkPolicy policy(silent);
  EXPECT_EQ(policy.effect().least.tail(9), Eigen::VectorXd::Ones(9));
  EXPECT_EQ(policy.effect().least.head(8), Eigen::VectorXd::Zero(8));
  EXPECT_TRUE(policy.steps_of_equal_effect().allFinite());
  const double given[] = {1, 2, .5};
  const Eigen::VectorXd variance = policy.noise_variance(given);
  EXPECT_EQ(variance[3], 1);
  EXPECT_EQ(variance[4], 2);
  EXPECT_EQ(variance[8], .5);
}

TEST(NetworkPolicyTest, EveryThetaThatItTakesGivesFiniteOutputs) {
  const NetworkPolicy policy = example_network();
  const Eigen::VectorXd large = Eigen::VectorXd::Constant(17, 1e49);
  EXPECT_TRUE(act_network(*policy.with(large), 1e308, -1e308).allFinite());
  EXPECT_TRUE(act_network(*policy.with(Eigen::VectorXd::Zero(17)), 1e308, -1e308).allFinite());
  EXPECT_THROW((void)policy.with(100 * large), std::invalid_argument);
}

TEST(NetworkPolicyTest, RefusesTextsThatAreNoPolicyWithTheirPlace) {
  const nlohmann::json whole = nlohmann::json::parse(to_json(example_network()));
  const auto refusal = [&](const char* where, const nlohmann::json& value) {
    nlohmann::json text = whole;
    text[nlohmann::json::json_pointer(where)] = value;
    const Result<PolicyPtr> policy = standard_policies().from_json(text.dump());
    return policy ? std::string("accepted") : policy.error().message;
  };
  EXPECT_THAT(refusal("/ranges/1", {3, 3}), HasSubstr("$.ranges[1]"));
  EXPECT_THAT(refusal("/ranges/1", {0, 5e-324}), HasSubstr("$.ranges[1]"));
  EXPECT_THAT(refusal("/ranges", nlohmann::json::array()), HasSubstr("$.ranges"));
  EXPECT_THAT(refusal("/inner/2", {1, 2}), HasSubstr("$.inner[2]"));
  EXPECT_THAT(refusal("/outer/0", {1, 2}), HasSubstr("$.outer[0]"));
  EXPECT_THAT(refusal("/outer/0/1", 1e60), HasSubstr("past"));
  EXPECT_THAT(refusal("/hidden", 3), HasSubstr("$"));
}

}  // namespace
}  // namespace treeroll
