// Bounds of a policy: whoever asks it, nothing beyond them is given out.
#include "common/policy/policy_bounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/policy/kinds/standard_policies.h"
#include "common/policy/linear/linear_policy.h"
#include "common/policy/linear/spline_form.h"
#include "common/settings/settings_reader.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A straight line from 0 to `end` over [0, 1], two layers.
PolicyPtr line_policy(double end) {
  const auto ladder = std::make_shared<SplineLadder>(BSpline(1, 2, 0, 1), 2);
  Eigen::MatrixXd coefficients(1, 3);
  coefficients << 0, end / 2, end;
  return std::make_shared<LinearPolicy>(std::make_shared<SplineForm>(ladder, nullptr), coefficients,
                                        2);
}

PolicyPtr with_bounds(const char* table, const PolicyPtr& policy) {
  const json settings = json::parse(table);
  json resolved;
  return bounded(policy,
                 read_policy_bounds(SettingsReader(settings, "policy.bounds", resolved), policy));
}

std::vector<double> acted(const Policy& policy, const std::vector<double>& inputs) {
  const auto controller = policy.controller();
  controller->start();
  std::vector<double> outputs;
  for (const double input : inputs)
    outputs.push_back(static_cast<Controller&>(*controller).act(input));
  return outputs;
}

template <class Error>
std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(PolicyBoundsTest, ClipsOutputsToTheirRange) {
  const auto policy = with_bounds(
      R"({"outside": "clip", "output_min": [1.0], "output_max": [6.0]})", line_policy(8));
  EXPECT_THAT(acted(*policy, {0, .25, .5, 1}), ElementsAre(1, 2, 4, 6));
  EXPECT_EQ(policy->kind(), "spline");
}

TEST(PolicyBoundsTest, ClipsTheRateFromWhatWasGivenLast) {
  const auto policy = with_bounds(
      R"({"outside": "clip", "output_rate_max": [20.0], "sample_time_s": 0.1, "output_start": [0.5]})",
      line_policy(8));
  EXPECT_THAT(acted(*policy, {1, 1, 1, 1, 1, 0}), ElementsAre(2.5, 4.5, 6.5, 8, 8, 6));
  const auto unstarted = with_bounds(
      R"({"outside": "clip", "output_rate_max": [20.0], "sample_time_s": 0.1})", line_policy(8));
  EXPECT_THAT(acted(*unstarted, {1, 0}), ElementsAre(8, 6));
}

TEST(PolicyBoundsTest, AllAtOnceAndARollOutAnewGiveTheSame) {
  const auto policy = with_bounds(
      R"({"outside": "clip", "output_max": [7.0], "output_rate_max": [20.0], "sample_time_s": 0.1})",
      line_policy(8));
  const std::vector<double> inputs = {0, 1, .2, .9, .9, .9};
  const auto controller = policy->controller();
  for (int i = 0; i < 2; ++i) {
    controller->start();
    std::vector<double> outputs(inputs.size());
    controller->act_all(inputs, outputs);
    EXPECT_EQ(outputs, acted(*policy, inputs));
  }
}

TEST(PolicyBoundsTest, RefusesAndGivesNothingOut) {
  const auto policy = with_bounds(
      R"({"outside": "refuse", "output_max": [6.0], "output_rate_max": [30.0], "sample_time_s": 0.1})",
      line_policy(8));
  const auto controller = policy->controller();
  controller->start();
  double output = -1;
  const auto ask = [&](double input) { controller->act({&input, 1}, {&output, 1}); };
  EXPECT_EQ(error_of<std::runtime_error>([&] { ask(1); }),
            "output 1 is 8, must be at most 6 (policy.bounds)");
  EXPECT_EQ(output, -1);
  ask(.25);
  EXPECT_EQ(output, 2);
  EXPECT_EQ(error_of<std::runtime_error>([&] { ask(.7); }),
            "output 1 is 5.6, must be by its rate at most 5 (policy.bounds)");
  EXPECT_EQ(output, 2);
  // What was refused was not given: the rate counts from what was.
  ask(.6);
  EXPECT_DOUBLE_EQ(output, 4.8);
}

TEST(PolicyBoundsTest, WhatIsNotFiniteIsRefusedAndTheRateStillHolds) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const char* outside : {"clip", "refuse"}) {
    json table{{"outside", outside}, {"output_rate_max", {20.0}}, {"sample_time_s", .1}};
    const auto policy = with_bounds(table.dump().c_str(), line_policy(8));
    const auto controller = policy->controller();
    controller->start();
    double output = -1;
    const auto ask = [&](double input) { controller->act({&input, 1}, {&output, 1}); };
    ask(.25);
    EXPECT_EQ(error_of<std::runtime_error>([&] { ask(kNan); }),
              "output 1 is nan, must be finite (policy.bounds)");
    EXPECT_EQ(output, 2);
    if (std::string_view(outside) == "clip") {
      ask(1);
      EXPECT_EQ(output, 4);
    } else {
      EXPECT_THAT(error_of<std::runtime_error>([&] { ask(1); }), HasSubstr("at most 4"));
    }
  }
}

TEST(PolicyBoundsTest, TheRateHoldsOnWhenAnotherControllerTakesOver) {
  const auto policy = with_bounds(
      R"({"outside": "clip", "output_rate_max": [20.0], "sample_time_s": 0.1})", line_policy(8));
  const auto before = policy->controller();
  EXPECT_EQ(static_cast<Controller&>(*before).act(0), 0);
  const auto after = policy->controller();
  go_on_from(*before, *after);
  EXPECT_EQ(static_cast<Controller&>(*after).act(1), 2);
  after->start();
  EXPECT_EQ(static_cast<Controller&>(*after).act(1), 8);
}

TEST(PolicyBoundsTest, APolicyWhoseOwnThetaIsBeyondDoesNotAct) {
  for (const char* outside : {"clip", "refuse"}) {
    const json table{{"outside", outside}, {"theta_max", {9.0}}};
    json text = json::parse(to_json(*with_bounds(table.dump().c_str(), line_policy(8))));
    text["bounds"]["theta_max"] = {5.0};
    const Result<PolicyPtr> read = standard_policies().from_json(text.dump());
    ASSERT_TRUE(read) << read.error().message;
    if ((*read)->content()["bounds"]["outside"] == "clip") {
      EXPECT_THAT(acted(**read, {.5, 1}), ElementsAre(4, 5));
    } else {
      EXPECT_THAT(error_of<std::invalid_argument>([&] { (*read)->controller(); }),
                  HasSubstr("element 3 of theta is 8, must be at most 5"));
    }
  }
}

TEST(PolicyBoundsTest, TheLayerThatIsGoneOnWithIsWithinThem) {
  const auto policy = with_bounds(R"({"outside": "clip", "theta_max": [9.0]})", line_policy(8));
  json text = json::parse(to_json(*policy->at_layer(1)));
  text["bounds"]["theta_max"] = {3.0};
  const Result<PolicyPtr> read = standard_policies().from_json(text.dump());
  ASSERT_TRUE(read) << read.error().message;
  const NextLayer next = (*read)->next_layer(Eigen::Vector2d(0, 2));
  EXPECT_LE(next.policy->theta().maxCoeff(), 3);
}

TEST(PolicyBoundsTest, BoundsThetaInEveryLayer) {
  const char* table = R"({"outside": "clip", "theta_min": [-1.0], "theta_max": [9.0]})";
  const auto policy = with_bounds(table, line_policy(8));
  const auto changed = policy->with(Eigen::Vector3d(-5, 20, 3));
  EXPECT_EQ(changed->theta(), Eigen::VectorXd(Eigen::Vector3d(-1, 9, 3)));
  const NextLayer next = policy->at_layer(1)->next_layer(Eigen::Vector2d(-5, 3));
  EXPECT_EQ(next.policy->theta()[0], -1);
  EXPECT_EQ(next.policy->with(Eigen::Vector3d(0, 0, 99))->theta()[2], 9);
}

TEST(PolicyBoundsTest, RefusesATheta) {
  const auto policy = with_bounds(R"({"outside": "refuse", "theta_max": [9.0]})", line_policy(8));
  EXPECT_EQ(policy->with(Eigen::Vector3d(1, 2, 9))->theta()[2], 9);
  EXPECT_EQ(error_of<std::invalid_argument>([&] { policy->with(Eigen::Vector3d(1, 9.5, 3)); }),
            "element 2 of theta is 9.5, must be at most 9 (policy.bounds)");
}

TEST(PolicyBoundsTest, TravelWithThePolicysText) {
  for (const char* table : {R"({"outside": "clip", "output_min": [1.0], "theta_max": [100.0]})",
                            R"({"outside": "refuse", "output_max": [3.0], "output_rate_max": [1.0],
            "sample_time_s": 0.25, "output_start": [2.0]})"}) {
    const auto policy = with_bounds(table, line_policy(8));
    const std::string text = to_json(*policy);
    const Result<PolicyPtr> read = standard_policies().from_json(text);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(to_json(**read), text);
    EXPECT_EQ(to_json(*without_bounds(*read)), to_json(*line_policy(8)));
    EXPECT_EQ(sample_time_s(**read), sample_time_s(*policy));
  }
}

TEST(PolicyBoundsTest, APolicyWithoutThemKeepsItsText) {
  const PolicyPtr plain = line_policy(8);
  EXPECT_EQ(without_bounds(plain), plain);
  EXPECT_EQ(to_json(*plain).find("bounds"), std::string::npos);
}

TEST(PolicyBoundsTest, ATextWithBadOnesIsRefused) {
  const json good = json::parse(to_json(*with_bounds(
      R"({"outside": "clip", "output_min": [1.0], "output_max": [2.0]})", line_policy(8))));
  const auto refusal = [&](const char* pointer, const json& value) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    const Result<PolicyPtr> read = standard_policies().from_json(bad.dump());
    return read ? "is taken" : read.error().message;
  };
  EXPECT_THAT(refusal("/bounds", json::array()), HasSubstr("$.bounds is []: must be an object"));
  EXPECT_THAT(refusal("/bounds", nullptr), HasSubstr("$.bounds is null: must be an object"));
  EXPECT_THAT(refusal("/bounds/other", 1), HasSubstr("$.bounds.other is an unknown key"));
  EXPECT_THAT(refusal("/bounds/outside", "warn"), HasSubstr("must be one of: clip, refuse"));
  EXPECT_THAT(refusal("/bounds/output_max", json::array({.5})),
              HasSubstr("must be in order with the others"));
  EXPECT_THAT(refusal("/bounds/output_max", json::array({5, 6})), HasSubstr("holds 2 elements"));
  EXPECT_THAT(refusal("/bounds/output_rate_max", json::array({1})),
              HasSubstr("$.bounds.sample_time_s is 0.0: must be above 0"));
  EXPECT_THAT(refusal("/bounds/output_rate_max", json::array({-1})), HasSubstr("must be above 0"));
}

TEST(PolicyBoundsTest, AStartIsWithinThemInEveryLayer) {
  // Of the curve 0, 8, 0 the coarse layer sees a straight line.
  const auto ladder = std::make_shared<SplineLadder>(BSpline(1, 2, 0, 1), 2);
  Eigen::MatrixXd coefficients(1, 3);
  coefficients << 0, 8, 0;
  const auto start =
      LinearPolicy(std::make_shared<SplineForm>(ladder, nullptr), coefficients, 2).at_layer(1);
  ASSERT_LT(start->theta().maxCoeff(), 7);
  EXPECT_THAT(error_of<ConfigError>(
                  [&] { with_bounds(R"({"outside": "clip", "theta_max": [7]})", start); }),
              HasSubstr("in layer 2: element 2 of theta is 8"));
}

TEST(PolicyBoundsTest, SettingsThatCannotBeAreRefused) {
  const auto refusal = [](const char* table) {
    return error_of<ConfigError>([&] { with_bounds(table, line_policy(8)); });
  };
  EXPECT_EQ(refusal("{}"), "policy.bounds.outside: is required and missing");
  EXPECT_THAT(refusal(R"({"outside": "clip", "output_min": [2], "output_max": [1]})"),
              HasSubstr("policy.bounds.output_max = [1]: must not be below output_min"));
  EXPECT_THAT(refusal(R"({"outside": "clip", "output_rate_max": [2]})"),
              HasSubstr("policy.bounds.sample_time_s: is required and missing"));
  EXPECT_THAT(refusal(R"({"outside": "clip", "sample_time_s": 1})"),
              HasSubstr("policy.bounds.sample_time_s = 1: unknown key"));
  EXPECT_THAT(refusal(R"({"outside": "clip", "output_min": [1, 2]})"),
              HasSubstr("output_min = [1,2]: must hold"));
  EXPECT_THAT(refusal(R"({"outside": "clip", "output_max": [1], "output_rate_max": [1],
                  "sample_time_s": 1, "output_start": [3]})"),
              HasSubstr("output_start = [3]: must not be above output_max"));
  EXPECT_THAT(refusal(R"({"outside": "clip", "theta_max": [7]})"),
              AllOf(HasSubstr("policy.bounds.theta_max = [7]: the start policy is beyond"),
                    HasSubstr("in layer 1: element 2"), HasSubstr("of theta is 8")));
  EXPECT_THAT(refusal(R"({"outside": "clip", "theta_min": [-100], "theta_max": [7]})"),
              HasSubstr("policy.bounds.theta_max = [7]: the start policy is beyond"));
  EXPECT_THAT(refusal(R"({"outside": "clip", "theta_min": [50]})"),
              HasSubstr("policy.bounds.theta_min = [50]: the start policy is beyond"));
}

}  // namespace
}  // namespace treeroll
