#include "common/policy/ds_gmr/ds_gmr_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/tree/tree_policy.h"
#include "tests/explore/trees.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

constexpr DsGmrPolicy::Pull kPull{.low = 0, .high = 2, .stiffness = 300};

PolicyPtr attractor_over(TreeModel tree, int layer = 1) {
  return std::make_shared<TreePolicy>(std::move(tree), layer, ThetaLayout::kMeansCholesky);
}

DsGmrPolicy two_layers() { return {attractor_over(explore::two_layer_tree()), kPull}; }

/// Two outputs over time.
DsGmrPolicy two_outputs_over_time() {
  test::RandomMixture random(8);
  return {attractor_over(TreeModel::from_global(FrameKind::kCholesky, {random.gmm(1, 3, 3)}, {{}})),
          {.low = -3, .high = 4, .stiffness = 25}};
}

Eigen::VectorXd movement_at(const Policy& policy, double time) {
  Eigen::VectorXd output(policy.output_dim());
  policy.controller()->act({&time, 1}, {output.data(), static_cast<std::size_t>(output.size())});
  return output;
}

TEST(DsGmrPolicyTest, BeginsAtRestOnItsAttractorAndFollowsIt) {
  const DsGmrPolicy policy = two_outputs_over_time();
  EXPECT_LT((movement_at(policy, -3) - movement_at(*policy.attractor(), -3)).norm(), 1e-12);
  // After the first place of the table it has gone less than kp h^2 / 6 of what its attractor has.
  const double soon = -3 + 7. / 1024;
  EXPECT_LT((movement_at(policy, soon) - movement_at(policy, -3)).norm(),
            1e-3 * (movement_at(*policy.attractor(), soon) - movement_at(policy, -3)).norm());
  // u'' = kp (uhat - u) - kv u', by differences over places of the table.
  const double step = 7. / 1024;
  for (int place = 100; place < 1000; place += 90) {
    const double t = -3 + place * step;
    const Eigen::VectorXd before = movement_at(policy, t - step);
    const Eigen::VectorXd at = movement_at(policy, t);
    const Eigen::VectorXd after = movement_at(policy, t + step);
    const Eigen::VectorXd acceleration = (after - 2 * at + before) / (step * step);
    const Eigen::VectorXd pull =
        25 * (movement_at(*policy.attractor(), t) - at) - 10 * (after - before) / (2 * step);
    EXPECT_LT((acceleration - pull).norm(), .01 * (1 + pull.norm())) << t;
  }
}

TEST(DsGmrPolicyTest, AStiffSpringIsItsAttractor) {
  const PolicyPtr attractor = attractor_over(explore::two_layer_tree());
  Eigen::VectorXd theta = attractor->theta();
  theta.setLinSpaced(-1, 1);
  const DsGmrPolicy policy(attractor->with(theta), {.low = 0, .high = 2, .stiffness = 1e9});
  for (const double t : {.1, .7, 1.3, 2.}) {
    EXPECT_NEAR(movement_at(policy, t)[0], movement_at(*policy.attractor(), t)[0], 1e-3) << t;
  }
}

TEST(DsGmrPolicyTest, AnswersInAnyOrderAndKeepsItsEndValues) {
  const DsGmrPolicy policy = two_outputs_over_time();
  const auto controller = policy.controller();
  const auto act = [&](double time) {
    Eigen::Vector2d output;
    controller->act({&time, 1}, {output.data(), 2});
    return output;
  };
  const Eigen::Vector2d late = act(3.3);
  EXPECT_EQ(act(1e308), act(4));
  EXPECT_EQ(act(-1e308), act(-3));
  EXPECT_EQ(act(3.3), late);
  EXPECT_EQ(movement_at(policy, 3.3), late);
}

TEST(DsGmrPolicyTest, RoundTripsThroughItsTextToTheBit) {
  for (const DsGmrPolicy& policy : {two_layers(), two_outputs_over_time()}) {
    const Result<PolicyPtr> copy = standard_policies().from_json(to_json(policy));
    ASSERT_TRUE(copy) << copy.error().message;
    EXPECT_EQ(to_json(**copy), to_json(policy));
    EXPECT_EQ((*copy)->theta(), policy.theta());
    EXPECT_EQ(movement_at(**copy, .7), movement_at(policy, .7));
  }
}

TEST(DsGmrPolicyTest, TheNextLayerActsAsTheOneBefore) {
  const DsGmrPolicy policy = two_layers();
  Eigen::VectorXd theta = policy.theta();
  theta[1] += 2;
  const NextLayer next = policy.next_layer(theta);
  EXPECT_EQ(next.policy->kind(), "ds_gmr");
  EXPECT_EQ(next.policy->layer(), 2);
  EXPECT_NE(movement_at(*next.policy, 1), movement_at(policy, 1));
  for (const double t : {0., .4, 1.1, 2.}) {
    EXPECT_NEAR(movement_at(*next.policy, t)[0], movement_at(*policy.with(theta), t)[0], 1e-10);
  }
  // What a roll-out was drawn as is seen one layer finer.
  const auto projected = next.project(theta);
  ASSERT_TRUE(projected);
  EXPECT_NEAR(movement_at(*next.policy->with(*projected), 1.1)[0],
              movement_at(*policy.with(theta), 1.1)[0], 1e-6);
}

/// All means up by 1 is the whole movement up by 1: the derivatives by an output's means add up.
TEST(DsGmrPolicyTest, ItsEffectIsThatOfTheMovement) {
  const PolicyPtr attractor =
      std::make_shared<TreePolicy>(explore::flat_tree(), 1, ThetaLayout::kMeans);
  const DsGmrPolicy policy(attractor->with(Eigen::Vector4d(.4, 1, 1.5, -2)), kPull);
  const PolicyEffect effect = policy.effect();
  EXPECT_EQ(effect.outputs.rows(), 257);
  const Eigen::VectorXd up = effect.derivative.col(1) + effect.derivative.col(3);
  EXPECT_LT((up.array() - 1).abs().maxCoeff(), 1e-6);
  for (int n = 0; n < 257; n += 32) {
    EXPECT_NEAR(effect.outputs(n, 0), movement_at(policy, 2. * n / 256)[0], 1e-3);
  }
}

/// Nothing moves where all outputs are 0: ten times what half a deviation is worth beside the
/// outputs' spread is the most that a mean input steps.
TEST(DsGmrPolicyTest, MeanInputsStepByNoMoreThanTheirGaussianIsWide) {
  const Gmm gmm = explore::spaced_gmm(2);
  const DsGmrPolicy policy(
      std::make_shared<TreePolicy>(explore::flat_tree(), 1, ThetaLayout::kMeans), kPull);
  const Eigen::VectorXd steps = policy.steps_of_equal_effect();
  for (int k = 0; k < 2; ++k) {
    const double half = .5 * std::sqrt(gmm[k].covariance(0, 0));
    EXPECT_LE(steps[2 * k], 1.001 * 10 * half / std::sqrt(gmm[k].covariance(1, 1)));
    EXPECT_NEAR(policy.effect().least[2 * k], 1 / half, 1e-12);
    EXPECT_EQ(policy.effect().least[2 * k + 1], 0);
  }
}

/// A logger's time begins anywhere.
TEST(DsGmrPolicyTest, ItsEffectIsTheSameAtAnyTime) {
  const auto effect_at = [](double time) {
    std::vector<Component> components = explore::spaced_gmm(2).components();
    for (Component& component : components) component.mean[0] += time;
    components[0].mean[1] = 1;
    components[1].mean[1] = -2;
    const TreeModel tree =
        TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, std::move(components))}, {{}});
    return DsGmrPolicy(std::make_shared<TreePolicy>(tree, 1, ThetaLayout::kMeans),
                       {.low = time, .high = time + 2, .stiffness = 300})
        .effect();
  };
  const Eigen::MatrixXd derivative = effect_at(0).derivative;
  EXPECT_GT(derivative.col(0).cwiseAbs().maxCoeff(), .1);
  for (const double time : {1e5, -1e6, 1.7e9}) {
    EXPECT_LT((effect_at(time).derivative - derivative).cwiseAbs().maxCoeff(),
              1e-3 * derivative.cwiseAbs().maxCoeff())
        << time;
  }
}

TEST(DsGmrPolicyTest, EveryThetaThatItTakesGivesFiniteOutputs) {
  const DsGmrPolicy policy = two_outputs_over_time();
  int num_taken = 0;
  for (const double size : {1e-8, 1., 1e3, 1e6}) {
    for (std::uint32_t draw = 0; draw < 20; ++draw) {
      const Eigen::VectorXd theta =
          policy.theta() + size * test::RandomMixture(draw).vector(policy.theta_dim());
      try {
        const PolicyPtr taken = policy.with(theta);
        for (const double t : {-3., 1., 4.}) EXPECT_TRUE(movement_at(*taken, t).allFinite());
        ++num_taken;
      } catch (const std::invalid_argument&) {
        continue;  // no such mixture
      }
    }
  }
  EXPECT_GT(num_taken, 20);
}

TEST(DsGmrPolicyTest, ShowsItsGaussiansAndTheMovementOfEachLayer) {
  const DsGmrPolicy policy = two_layers();
  const PolicySketch sketch = policy.sketch();
  ASSERT_EQ(sketch.layers.size(), 2U);
  EXPECT_EQ(sketch.layers[0].gaussians.size(), 2U);
  EXPECT_EQ(sketch.layers[1].gaussians.size(), 4U);
  EXPECT_EQ(sketch.layers[1].controller->act(.7), movement_at(policy, .7)[0]);
  EXPECT_EQ(sketch.inputs.at(0).high, 2);
  EXPECT_EQ(sketch.look, policy.at_layer(2)->sketch().look);
}

TEST(DsGmrPolicyTest, RefusesTextsThatAreNoPolicyWithTheirPlace) {
  const nlohmann::json whole = nlohmann::json::parse(to_json(two_layers()));
  const auto refusal = [&](const char* where, const nlohmann::json& value) {
    nlohmann::json text = whole;
    text[nlohmann::json::json_pointer(where)] = value;
    const Result<PolicyPtr> policy = standard_policies().from_json(text.dump());
    return policy ? std::string("accepted") : policy.error().message;
  };
  EXPECT_THAT(refusal("/range", {3, 3}), HasSubstr("$.range is [3,3]: must begin before it ends"));
  EXPECT_THAT(refusal("/range", {1}), HasSubstr("$.range"));
  EXPECT_THAT(refusal("/stiffness", 0), HasSubstr("$.stiffness is 0: its root times the duration"));
  EXPECT_THAT(refusal("/stiffness", -1), HasSubstr("$.stiffness"));
  EXPECT_THAT(refusal("/stiffness", 1e11), HasSubstr("$.stiffness"));
  EXPECT_THAT(refusal("/stiffness", "stiff"), HasSubstr("$.stiffness"));
  EXPECT_EQ(refusal("/stiffness", .25), "accepted");  // both bounds of 2 s
  EXPECT_EQ(refusal("/stiffness", 2.5e9), "accepted");
  EXPECT_THAT(refusal("/stiffness", .2499999), HasSubstr("$.stiffness"));
  EXPECT_THAT(refusal("/stiffness", 2.500001e9), HasSubstr("$.stiffness"));
  EXPECT_THAT(refusal("/range", {0, 1e-300}), HasSubstr("$.stiffness"));
  EXPECT_THAT(refusal("/range", {0, 1e300}), HasSubstr("$.stiffness"));
  EXPECT_THAT(refusal("/attractor/layer", 3), HasSubstr("$.attractor.layer"));
  EXPECT_THAT(refusal("/attractor", nullptr), HasSubstr("$.attractor"));
  EXPECT_THAT(refusal("/damping", 3), HasSubstr("$.damping"));
  test::RandomMixture random(1);
  const TreePolicy state(TreeModel::from_global(FrameKind::kCholesky, {random.gmm(2, 3, 1)}, {{}}),
                         1, ThetaLayout::kMeans);
  EXPECT_THAT(refusal("/attractor", state.content()), HasSubstr("must have one input"));
}

}  // namespace
}  // namespace treeroll
