#include "workers/tasks/hold_task.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using Gains = Eigen::Matrix<double, 6, 1>;

/// acceleration = gains . state + offset, as a mixture of one component.
Gmm feedback(const Gains& gains, double offset = 0) {
  Component component{1, Eigen::VectorXd::Zero(7), Eigen::MatrixXd::Identity(7, 7)};
  component.mean[6] = offset;
  component.covariance.block(6, 0, 1, 6) = gains.transpose();
  component.covariance.block(0, 6, 6, 1) = gains;
  component.covariance(6, 6) += gains.squaredNorm();
  return Gmm(6, {component});
}

/// Linear quadratic regulators for the equations of motion linearised about the target, from a
/// Riccati recursion at 10 ms: weights diag(100, 100, 1, 1, 10, 1) and .1 upright, diag(10, 10, 1,
/// 1, 1, 1) and 1 hanging.
const Gains kUprightRegulator =
    (Gains() << -142.848, 202.69, -2.648, -5.003, 34.423, -6.679).finished();
const Gains kHangingRegulator = (Gains() << 6.299, -2.179, -.962, 1.72, .494, -1.912).finished();
const Gains kNone = Gains::Zero();

constexpr const char* kAtRest = R"("start_phi1": 0, "start_phi2": 0)";

TEST(HoldTaskTest, HasTheSixStatesAsInputs) {
  const TaskDescription d = standard_task("hold", "{}")->description();
  EXPECT_EQ(d.input_dim, 6);
  EXPECT_EQ(d.output_dim, 1);
  EXPECT_EQ(d.reward_max, 1);
  EXPECT_TRUE(d.deterministic);
  EXPECT_FALSE(standard_task("hold", R"({"variation": {"parameter_fraction": 0.02}})")
                   ->description()
                   .deterministic);
}

TEST(HoldTaskTest, WhatRestsAtTheTargetGetsRewardOne) {
  const auto task =
      standard_task("hold", std::string(R"({"plant": "rk4", "duration_s": 0.5, )") + kAtRest + "}");
  EXPECT_NEAR(evaluate(*task, feedback(kNone), 0).reward(), 1, 1e-12);
}

TEST(HoldTaskTest, ATraceHasTheStatesThatThePolicySawAndTheSameReward) {
  const auto task = standard_task("hold", R"({"plant": "rk4", "duration_s": 1})");
  Trace trace;
  const Outcome traced = evaluate_traced(*task, feedback(kHangingRegulator), 0, trace);
  EXPECT_EQ(traced.reward(), evaluate(*task, feedback(kHangingRegulator), 0).reward());
  EXPECT_EQ(trace.policy_inputs().size(), 6U);
  const std::size_t width = trace.columns().size();
  ASSERT_EQ(width, 9U);
  ASSERT_GT(trace.numbers().size(), 10 * width);
  // The start is .3 and -.2 from the target, at rest.
  EXPECT_NEAR(trace.numbers()[1], .3, 1e-12);
  EXPECT_NEAR(trace.numbers()[2], -.2, 1e-12);
  for (std::size_t row = 0; row < trace.numbers().size(); row += width) {
    const Eigen::Map<const Gains> state(&trace.numbers()[row + 1]);
    EXPECT_NEAR(trace.numbers()[row + 7], kHangingRegulator.dot(state), 1e-9);
  }
}

TEST(HoldTaskTest, APushedCartGetsTheMeanCostOfItsPath) {
  // With no gravity and no friction to speak of the links would swing; with tiny arms they do not
  // move, and the cart's path alone counts: c = (.7 a t^2 / 2)^4 + (a t)^2 / 50.
  const auto task =
      standard_task("hold", std::string(R"({"plant": "rk4", "alpha": 2, "duration_s": 1,
      "parameters": {"gravity": 0, "a1": 1e-6, "a2": 1e-6, "l1": 1e-6, "j1": 1000, "j2": 1000}, )") +
                                kAtRest + "}");
  const double a = .8;
  const double mean = std::pow(.35 * a, 4) / 9 + a * a / 3 / 50;
  EXPECT_NEAR(evaluate(*task, feedback(kNone, a), 0).reward(), std::exp(-2 * mean), 1e-6);
}

TEST(HoldTaskTest, TheOutputIsCutToWhatTheCartCanDo) {
  const auto cut = standard_task("hold", R"({"plant": "rk4", "acceleration_max_mps2": 0.5})");
  EXPECT_EQ(evaluate(*cut, feedback(kNone, 30), 0).reward(),
            evaluate(*cut, feedback(kNone, .5), 0).reward());
  EXPECT_NE(evaluate(*cut, feedback(kNone, .4), 0).reward(),
            evaluate(*cut, feedback(kNone, .5), 0).reward());
}

TEST(HoldTaskTest, ARegulatorDampsWhatFrictionAloneDampsSlowly) {
  for (const char* plant : {"rk4", "ode"}) {
    const auto task = standard_task("hold", std::string(R"({"plant": ")") + plant + "\"}");
    const double without = evaluate(*task, feedback(kNone), 0).reward();
    const double with = evaluate(*task, feedback(kHangingRegulator), 0).reward();
    EXPECT_LT(without, .6) << plant;
    EXPECT_GT(with, without + .2) << plant;
    EXPECT_LT(evaluate(*task, feedback(-kHangingRegulator), 0).reward(), without) << plant;
  }
}

TEST(HoldTaskTest, UprightFallsWithoutFeedbackAndStandsWithIt) {
  for (const char* plant : {"rk4", "ode"}) {
    const auto task = standard_task("hold", std::string(R"({"target": "upright", "start_phi1": 0.02,
                                           "start_phi2": -0.02, "plant": ")") +
                                                plant + "\"}");
    EXPECT_LT(evaluate(*task, feedback(kNone), 0).reward(), 1e-3) << plant;
    EXPECT_GT(evaluate(*task, feedback(kUprightRegulator), 0).reward(), .9) << plant;
  }
}

TEST(HoldTaskTest, WithItsRegulatorAPolicyThatDoesNothingHolds) {
  for (const char* plant : {"rk4", "ode"}) {
    for (const char* target : {"upright", "hanging"}) {
      const auto verdict = [&](const char* feedback_key) {
        const json settings = {
            {"start_phi1", .05}, {"start_phi2", -.05}, {"variation", {{"parameter_fraction", .02}}},
            {"target", target},  {"plant", plant},     {"feedback", feedback_key}};
        const auto task = standard_task("hold", settings.dump());
        Trace trace;
        EXPECT_EQ(evaluate_traced(*task, feedback(kNone), 1, trace),
                  evaluate(*task, feedback(kNone), 1));
        EXPECT_EQ(trace.columns().back(), "holds");
        return trace.numbers().back() == 1;
      };
      EXPECT_TRUE(verdict("lqr")) << plant << ' ' << target;
      EXPECT_EQ(verdict("none"), target == std::string("hanging")) << plant;
    }
  }
}

TEST(HoldTaskTest, ThePolicyComesOnTopOfTheRegulator) {
  const auto task = [](const char* feedback_key) {
    const json settings = {{"plant", "rk4"},           {"target", "upright"},
                           {"start_phi1", .02},        {"start_phi2", .01},
                           {"feedback", feedback_key}, {"acceleration_max_mps2", 100}};
    return standard_task("hold", settings.dump());
  };
  // The regulator's gains as a policy, alone, and as the regulator.
  Gains gains;
  gains << -160.95173378650279, 260.41251882112397, -10, -2.779556338121472, 43.84116045683418,
      -15.25694207288792;
  EXPECT_NEAR(evaluate(*task("lqr"), feedback(kNone), 0).reward(),
              evaluate(*task("none"), feedback(gains), 0).reward(), 1e-9);
  EXPECT_NEAR(evaluate(*task("lqr"), feedback(gains / 2), 0).reward(),
              evaluate(*task("none"), feedback(1.5 * gains), 0).reward(), 1e-9);
}

TEST(HoldTaskTest, TheKeyFeedbackAloneChangesNoReward) {
  const auto plain = standard_task("hold", R"({"plant": "rk4"})");
  const auto with_key = standard_task("hold", R"({"plant": "rk4", "feedback": "none"})");
  EXPECT_EQ(evaluate(*plain, feedback(kHangingRegulator), 0),
            evaluate(*with_key, feedback(kHangingRegulator), 0));
}

TEST(HoldTaskTest, SaysWhatIsWrongWithItsSettings) {
  EXPECT_THAT(refusal("hold", R"({"target": "sideways"})"),
              HasSubstr("task.target = \"sideways\""));
  EXPECT_THAT(refusal("hold", R"({"duration_s": -1})"), HasSubstr("task.duration_s"));
  EXPECT_THAT(refusal("hold", R"({"acceleration_max_mps2": 0})"),
              HasSubstr("task.acceleration_max_mps2"));
  EXPECT_THAT(refusal("hold", R"({"gain": 1})"), HasSubstr("task.gain"));
  EXPECT_THAT(refusal("hold", R"({"feedback": "pid"})"), HasSubstr("task.feedback = \"pid\""));
  EXPECT_THAT(refusal("hold", R"({"feedback": "lqr", "duration_s": 1})"),
              HasSubstr("task.holds.after_s: 1.5 s must be below the 1 s at which holding ends"));
  EXPECT_THAT(refusal("hold", R"({"lqr": {}})"), HasSubstr("task.lqr"));
}

}  // namespace
}  // namespace treeroll
