#include "workers/tasks/swing_up_and_hold_task.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/tasks/following.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

constexpr const char* kRk4 = R"("plant": "rk4", "step_s": 0.005)";
constexpr const char* kOde = R"("plant": "ode")";
/// Each number of the plant within 2 %, the start .02 rad beside that of the nominal motion.
constexpr const char* kPerturbed =
    R"("variation": {"parameter_fraction": 0.02, "start_deviation_rad": 0.02})";

std::unique_ptr<Task> task_of(const std::string& settings) {
  return standard_task("swing_up", "{" + settings + "}");
}
std::unique_ptr<Task> perturbed(const std::string& feedback, const std::string& plant = kRk4) {
  return task_of(plant + ", " + kPerturbed + R"(, "feedback": ")" + feedback + "\"");
}

TEST(SwingUpAndHoldTaskTest, DescribesItself) {
  const TaskDescription d = perturbed("lqr")->description();
  EXPECT_EQ(d.input_dim, 1);
  EXPECT_EQ(d.output_dim, 1);
  EXPECT_EQ(d.reward_min, 0);
  EXPECT_EQ(d.reward_max, 1);
  EXPECT_FALSE(d.deterministic);
  EXPECT_TRUE(task_of(R"("feedback": "lqr")")->description().deterministic);
}

/// (4-7) is that of the acceleration alone.
TEST(SwingUpAndHoldTaskTest, WithNothingForHoldingTheRewardIsThatOfTheSwingUpToTheBit) {
  for (const std::string plant : {kRk4, kOde}) {
    const double reward = evaluate(*task_of(plant), following(sim::kPublished), 0).reward();
    for (const char* feedback : {"lqr", "none"}) {
      const auto task = task_of(plant + R"(, "acceleration_max_mps2": 100, "feedback": ")" +
                                feedback + R"(", "holds": {"reward_share": 0})");
      EXPECT_EQ(evaluate(*task, following(sim::kPublished), 0).reward(), reward)
          << plant << feedback;
    }
  }
  const std::string dopri5 = R"("plant": "dopri5")";
  const auto task = task_of(dopri5 + R"(, "feedback": "lqr", "holds": {"reward_share": 0})");
  EXPECT_NEAR(evaluate(*task, following(sim::kPublished), 0).reward(),
              evaluate(*task_of(dopri5), following(sim::kPublished), 0).reward(), 1e-4);
}

TEST(SwingUpAndHoldTaskTest, FeedbackHoldsEachPerturbedPlantAndWithoutItEachFalls) {
  const Gmm policy = following(sim::kRefined);
  // On ODE the nominal motion of this acceleration ends too far from upright for 20 m/s^2.
  const std::string ode = std::string(kOde) + R"(, "acceleration_max_mps2": 100)";
  for (const auto& [plant, num_seeds] : {std::pair<std::string, int>{kRk4, 50}, {ode, 2}}) {
    const auto closed = perturbed("lqr", plant);
    const auto open = perturbed("none", plant);
    for (int seed = 0; seed < num_seeds; ++seed) {
      EXPECT_GT(evaluate(*closed, policy, seed).reward(), .98) << plant << ", seed " << seed;
      EXPECT_LT(evaluate(*open, policy, seed).reward(), .5) << plant << ", seed " << seed;
    }
  }
}

/// A seed's plants are the same whatever was evaluated before.
TEST(SwingUpAndHoldTaskTest, ASeedGivesTheSameBits) {
  const auto task = task_of(std::string(kRk4) + R"(, "feedback": "lqr",
      "variation": {"evaluations": 4, "parameter_fraction": 0.2, "start_deviation_rad": 0.2})");
  const Gmm policy = following(sim::kRefined);
  const double first = evaluate(*task, policy, 3).reward();
  (void)evaluate(*task, line(3, -2), 4);
  EXPECT_EQ(evaluate(*task, policy, 3).reward(), first);
}

TEST(SwingUpAndHoldTaskTest, APolicyThatDoesNothingGetsHalfTheRewardOfTheStart) {
  for (const char* feedback : {"lqr", "none"}) {
    const auto task = task_of(std::string(kRk4) + R"(, "feedback": ")" + feedback + "\"");
    EXPECT_NEAR(evaluate(*task, line(0, 0), 0).reward(), .5 * std::exp(-2.5), 1e-6) << feedback;
  }
}

TEST(SwingUpAndHoldTaskTest, UprightFromTheStartTheRegulatorHoldsAtOnce) {
  const std::string start = R"(, "start_phi1": 0.05, "start_phi2": -0.05, "feedback": )";
  EXPECT_GT(evaluate(*task_of(kRk4 + start + R"("lqr")"), line(0, 0), 0).reward(), .99);
  EXPECT_LT(evaluate(*task_of(kRk4 + start + R"("none")"), line(0, 0), 0).reward(), .5);
}

TEST(SwingUpAndHoldTaskTest, ATraceHasTheNominalMotionBesideTheOneAndTellsWhetherItHolds) {
  for (const char* feedback : {"lqr", "none"}) {
    const auto task = perturbed(feedback);
    const Gmm policy = following(sim::kRefined);
    Trace trace;
    const Outcome traced = evaluate_traced(*task, policy, 5, trace);
    EXPECT_EQ(traced.reward(), evaluate(*task, policy, 5).reward());
    const std::size_t width = trace.columns().size();
    ASSERT_EQ(trace.columns().back(), "holds");
    const std::size_t num_rows = trace.numbers().size() / width;
    const auto at = [&](std::size_t row, std::size_t column) {
      return trace.numbers()[row * width + column];
    };
    const bool holds = at(num_rows - 1, width - 1) == 1;
    EXPECT_EQ(holds, feedback == std::string("lqr"));
    EXPECT_EQ(traced.reward() > .5, holds);
    EXPECT_EQ(at(0, width - 1), 0) << "not before after_s";
    EXPECT_EQ(at(0, 9), -M_PI) << "the nominal motion begins at the settings' start";
    EXPECT_NE(at(0, 1), -M_PI) << "and this one beside it";
    EXPECT_EQ(at(num_rows - 1, 9), 0) << "then it is to stand upright";
    for (std::size_t row = 0; row < num_rows; ++row) {
      EXPECT_LE(std::fabs(at(row, 7)), 20) << "what the cart can do";
    }
    std::size_t caught = 0;  // the instant of least cost: from it on upright is the goal
    while (at(caught, 9) != 0) ++caught;
    EXPECT_NEAR(at(num_rows - 1, 0), at(caught, 0) + 5, 1e-9);
  }
}

TEST(SwingUpAndHoldTaskTest, WhatTheCartCannotDoIsCutBeforeTheNominalMotion) {
  const auto cut =
      task_of(std::string(kRk4) + R"(, "feedback": "none", "acceleration_max_mps2": 2.5)");
  EXPECT_EQ(evaluate(*cut, line(30, 0), 0).reward(), evaluate(*cut, line(2.5, 0), 0).reward());
  EXPECT_LT(evaluate(*cut, following(sim::kRefined), 0).reward(), .4) << "nothing swings up so";
}

TEST(SwingUpAndHoldTaskTest, ADivergedSimulationHasAStatusAndNoReward) {
  const auto task = task_of(R"("plant": "dopri5", "steps_max": 50, "feedback": "lqr")");
  const Outcome outcome = evaluate(*task, line(3, -2), 0);
  EXPECT_EQ(outcome.status(), RolloutStatus::kDiverged);
  EXPECT_EQ(outcome.reward(), 0);
}

TEST(SwingUpAndHoldTaskTest, SaysWhatIsWrongWithItsSettings) {
  const auto said = [](const std::string& settings) {
    return refusal("swing_up", R"({"feedback": "lqr", )" + settings + "}");
  };
  EXPECT_THAT(refusal("swing_up", R"({"feedback": "pid"})"),
              HasSubstr("task.feedback = \"pid\": must be one of"));
  EXPECT_THAT(said(R"("acceleration_max_mps2": 0)"), HasSubstr("task.acceleration_max_mps2"));
  EXPECT_THAT(said(R"("holds": {"until_s": 1})"),
              HasSubstr("task.holds.after_s: 1.5 s must be below the 1 s at which holding ends"));
  EXPECT_THAT(said(R"("holds": {"angle_max_rad": 0})"), HasSubstr("task.holds.angle_max_rad"));
  EXPECT_THAT(said(R"("holds": {"reward_share": 2})"), HasSubstr("task.holds.reward_share"));
  EXPECT_THAT(said(R"("lqr": {"input_weight": -1})"), HasSubstr("task.lqr.input_weight"));
  // Keys that would change nothing are refused.
  EXPECT_THAT(refusal("swing_up", R"({"feedback": "none", "lqr": {}})"), HasSubstr("task.lqr"));
  EXPECT_THAT(refusal("swing_up", R"({"holds": {}})"), HasSubstr("task.holds"));
  EXPECT_THAT(refusal("swing_up", R"({"acceleration_max_mps2": 3})"),
              HasSubstr("task.acceleration_max_mps2"));
}

}  // namespace
}  // namespace treeroll
