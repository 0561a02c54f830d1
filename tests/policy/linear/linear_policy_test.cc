#include "common/policy/linear/linear_policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/linear/basis_form.h"
#include "common/policy/linear/spline_form.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

std::shared_ptr<const SplineLadder> ladder_4_5_7() {
  return std::make_shared<SplineLadder>(BSpline(3, 4, 0, 2.2), 3);
}

RecordedCurvePtr recording() {
  Eigen::MatrixXd outputs(2, 3);
  outputs << 1, 3, 2, -1, 0, 5;
  return std::make_shared<RecordedCurve>(std::vector<double>{0, 1, 2.2}, outputs);
}

using LinearPolicyPtr = std::shared_ptr<const LinearPolicy>;

LinearFormPtr spline_form(const RecordedCurvePtr& recorded) {
  return std::make_shared<SplineForm>(ladder_4_5_7(), recorded);
}

/// Splines and corrections at three layers each, then the kinds of one layer: 7 coefficients.
std::vector<LinearPolicyPtr> examples() {
  test::RandomMixture random(8);
  std::vector<LinearPolicyPtr> all;
  const auto add = [&](const LinearFormPtr& form) {
    for (int layer = 1; layer <= form->num_layers(); ++layer) {
      Eigen::MatrixXd coefficients(2, 7);
      coefficients << random.vector(7).transpose(), random.vector(7).transpose();
      all.push_back(std::make_shared<LinearPolicy>(form, coefficients, layer));
    }
  };
  add(spline_form(nullptr));
  add(spline_form(recording()));
  add(std::make_shared<RadialForm>(RadialBasis(7, 0, 2.2)));
  add(std::make_shared<PrimitiveForm>(MovementPrimitive(6, 0, 2.2), std::vector<double>{2, -1}));
  return all;
}

Eigen::Vector2d act(const Policy& policy, double input) {
  Eigen::Vector2d output;
  const auto controller = policy.controller();
  controller->start();
  controller->act({&input, 1}, {output.data(), 2});
  return output;
}

double difference(const Policy& a, const Policy& b) {
  double most = 0;
  for (double input = -.5; input < 3; input += .07) {
    most = std::max(most, (act(a, input) - act(b, input)).cwiseAbs().maxCoeff());
  }
  return most;
}

TEST(LinearPolicyTest, RoundTripsThroughItsTextToTheBit) {
  const PolicyRegistry policies = standard_policies();
  for (const auto& policy : examples()) {
    const std::string text = to_json(*policy);
    EXPECT_THAT(text, HasSubstr("\"kind\":\"" + std::string(policy->kind()) + "\""));
    const Result<PolicyPtr> copy = policies.from_json(text);
    ASSERT_TRUE(copy) << copy.error().message;
    EXPECT_EQ(to_json(**copy), text);
    EXPECT_EQ(difference(**copy, *policy), 0);
  }
}

TEST(LinearPolicyTest, ThetaIsWhatItWasMadeWith) {
  test::RandomMixture random(9);
  for (const auto& policy : examples()) {
    const Eigen::VectorXd theta = random.vector(policy->theta_dim());
    EXPECT_LT((policy->with(theta)->theta() - theta).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LT(difference(*policy->with(policy->theta()), *policy), 1e-13);
    for (int layer = 1; layer <= policy->num_layers(); ++layer) {
      EXPECT_EQ(difference(*policy->at_layer(layer), *policy), 0);
    }
  }
}

TEST(LinearPolicyTest, TheNextLayerActsAsTheOneBefore) {
  test::RandomMixture random(10);
  for (const auto& policy : examples()) {
    if (policy->layer() == policy->num_layers()) continue;
    const Eigen::VectorXd theta = random.vector(policy->theta_dim());
    const NextLayer next = policy->next_layer(theta);
    EXPECT_EQ(next.policy->layer(), policy->layer() + 1);
    EXPECT_LT(difference(*next.policy, *policy->with(theta)), 1e-13);
    const Eigen::VectorXd other = random.vector(policy->theta_dim());
    EXPECT_LT(difference(*next.policy->with(*next.project(other)), *policy->with(other)), 1e-12);
  }
}

TEST(LinearPolicyTest, IsLinearInTheta) {
  test::RandomMixture random(11);
  for (const auto& policy : examples()) {
    const Eigen::VectorXd a = random.vector(policy->theta_dim());
    const Eigen::VectorXd b = random.vector(policy->theta_dim());
    const Eigen::VectorXd between = .25 * a + .75 * b;
    for (const double input : {0., .3, 1.7, 2.5}) {
      const Eigen::Vector2d mixed =
          .25 * act(*policy->with(a), input) + .75 * act(*policy->with(b), input);
      EXPECT_LT((act(*policy->with(between), input) - mixed).norm(), 1e-13);
    }
  }
}

TEST(LinearPolicyTest, ACorrectionOfNothingIsItsRecording) {
  const LinearPolicy policy(spline_form(recording()), Eigen::MatrixXd::Zero(2, 7), 1);
  EXPECT_EQ(act(policy, 0), Eigen::Vector2d(1, -1));
  EXPECT_EQ(act(policy, .5), Eigen::Vector2d(2, -.5));
  EXPECT_EQ(act(policy, -4), Eigen::Vector2d(1, -1));
  EXPECT_EQ(act(policy, 9), Eigen::Vector2d(2, 5));
}

TEST(LinearPolicyTest, EveryThetaThatItTakesGivesFiniteOutputs) {
  for (const auto& policy : examples()) {
    const Eigen::VectorXd large = Eigen::VectorXd::Constant(policy->theta_dim(), 1e40);
    EXPECT_TRUE(act(*policy->with(large), 1e300).allFinite()) << policy->kind();
    EXPECT_TRUE(act(*policy->with(large), -1e300).allFinite()) << policy->kind();
    EXPECT_THROW((void)policy->with(1e20 * large), std::invalid_argument);
    EXPECT_THROW((void)policy->with(1e268 * large), std::invalid_argument);
  }
}

TEST(LinearPolicyTest, ItsEffectIsThatOfItsTheta) {
  for (const auto& policy : examples()) {
    const PolicyEffect effect = policy->effect();
    const Eigen::VectorXd step = Eigen::VectorXd::LinSpaced(policy->theta_dim(), -1, 2);
    const PolicyEffect moved = policy->with(policy->theta() + step)->effect();
    const Eigen::VectorXd expected = effect.derivative * step;
    const Eigen::VectorXd difference = (moved.outputs - effect.outputs).transpose().reshaped();
    EXPECT_LT((difference - expected).cwiseAbs().maxCoeff(), 1e-12) << policy->kind();
  }
}

TEST(LinearPolicyTest, AMovementPrimitiveBeginsWhereItIsToldAndEndsAtItsGoal) {
  const LinearFormPtr form =
      std::make_shared<PrimitiveForm>(MovementPrimitive(6, 1, 3.2), std::vector<double>{2, -1});
  test::RandomMixture random(12);
  Eigen::MatrixXd coefficients(2, 7);
  coefficients << random.vector(7).transpose(), random.vector(7).transpose();
  coefficients.col(6) = Eigen::Vector2d(5, -7);
  const LinearPolicy policy(form, coefficients, 1);
  EXPECT_EQ(act(policy, 1), Eigen::Vector2d(2, -1));
  EXPECT_EQ(act(policy, -3), Eigen::Vector2d(2, -1));
  EXPECT_EQ(act(policy, 9), act(policy, 3.2));
  coefficients.leftCols(6).setZero();
  EXPECT_LT((act(LinearPolicy(form, coefficients, 1), 3.2) - Eigen::Vector2d(5, -7)).norm(), 1e-3);
}

TEST(LinearPolicyTest, RefusesTextsThatAreNoPolicyWithTheirPlace) {
  const PolicyRegistry policies = standard_policies();
  const nlohmann::json spline = nlohmann::json::parse(to_json(*examples()[0]));
  const nlohmann::json correction = nlohmann::json::parse(to_json(*examples()[3]));
  const auto refusal = [&](nlohmann::json text, const char* where, const nlohmann::json& value) {
    text[nlohmann::json::json_pointer(where)] = value;
    const Result<PolicyPtr> policy = policies.from_json(text.dump());
    return policy ? std::string("accepted") : policy.error().message;
  };
  EXPECT_THAT(refusal(spline, "/degree", 8), HasSubstr("$.degree"));
  EXPECT_THAT(refusal(spline, "/degree", 2), HasSubstr("$.sizes[1]"));
  EXPECT_THAT(refusal(spline, "/sizes", {4, 6, 7}), HasSubstr("$.sizes[1]"));
  EXPECT_THAT(refusal(spline, "/sizes", {3, 5, 7}), HasSubstr("$.sizes[0]"));
  EXPECT_THAT(refusal(spline, "/sizes", {200, 397}), HasSubstr("$.sizes[1]"));
  EXPECT_THAT(refusal(spline, "/range", {1, 1}), HasSubstr("$.range"));
  EXPECT_THAT(refusal(spline, "/layer", 4), HasSubstr("$.layer"));
  EXPECT_THAT(refusal(spline, "/coefficients/0/3", 1e60), HasSubstr("past"));
  EXPECT_THAT(refusal(spline, "/coefficients/0/3", "x"), HasSubstr("$.coefficients[0][3]"));
  EXPECT_THAT(refusal(spline, "/inputs", {0, 1}), HasSubstr("$"));
  const nlohmann::json radial = nlohmann::json::parse(to_json(*examples()[6]));
  const nlohmann::json primitive = nlohmann::json::parse(to_json(*examples()[7]));
  EXPECT_THAT(refusal(radial, "/range", {1, 1}), HasSubstr("$.range"));
  for (const nlohmann::json& text : {spline, radial, primitive}) {
    EXPECT_THAT(refusal(text, "/range", {0, 5e-324}), HasSubstr("$.range"));
    EXPECT_THAT(refusal(text, "/range", {0, 1.7e308}), HasSubstr("by 1e-300 to 1e300"));
  }
  EXPECT_THAT(refusal(radial, "/layer", 2), HasSubstr("$.layer"));
  EXPECT_THAT(refusal(radial, "/coefficients", {{1}}), HasSubstr("$.coefficients[0]"));
  EXPECT_THAT(refusal(radial, "/coefficients/1", {1, 2}), HasSubstr("$.coefficients[1]"));
  EXPECT_THAT(refusal(radial, "/degree", 3), HasSubstr("$"));
  EXPECT_THAT(refusal(primitive, "/starts", {1}), HasSubstr("$.coefficients"));
  EXPECT_THAT(refusal(primitive, "/starts/1", "x"), HasSubstr("$.starts[1]"));
  EXPECT_THAT(refusal(primitive, "/coefficients", {{1, 2}, {1, 2}}),
              HasSubstr("$.coefficients[0]"));
  EXPECT_THAT(refusal(primitive, "/range", {1e16, 1e16 + 4}), HasSubstr("$.range"));
  EXPECT_THAT(refusal(correction, "/inputs", {0, 1, 1}), HasSubstr("$.inputs"));
  EXPECT_THAT(refusal(correction, "/outputs", {{1, 2}, {1, 2}}), HasSubstr("$.outputs[0]"));
  EXPECT_THAT(refusal(correction, "/coefficients", {{1, 2, 3, 4, 5, 6, 7}}),
              HasSubstr("$.coefficients"));
}

TEST(LinearPolicyTest, ItsPictureHasEveryLayerOverItsRange) {
  const PolicySketch sketch = examples()[0]->sketch();
  ASSERT_EQ(sketch.layers.size(), 3U);
  EXPECT_EQ(sketch.inputs.at(0).low, 0);
  EXPECT_EQ(sketch.inputs.at(0).high, 2.2);
  EXPECT_TRUE(sketch.layers[0].gaussians.empty());
  EXPECT_EQ(sketch.look, examples()[0]->at_layer(3)->sketch().look);
}

}  // namespace
}  // namespace treeroll
