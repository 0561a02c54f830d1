#include "workers/tasks/swing_up_task.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "tests/tasks/following.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"

namespace treeroll {
namespace {

using nlohmann::json;

TEST(SwingUpTaskTest, CostIsZeroUprightAtRestAndFollowsEquation46) {
  EXPECT_EQ(swing_up_cost({}), 0);
  EXPECT_DOUBLE_EQ(swing_up_cost({.phi1 = -M_PI, .phi2 = -M_PI}), 10);
  EXPECT_DOUBLE_EQ(swing_up_cost({.phi1 = 2 * M_PI}), 20);  // a turn is not upright
  EXPECT_DOUBLE_EQ(swing_up_cost({.y = 2}), std::pow(1.4, 4));
  EXPECT_DOUBLE_EQ(swing_up_cost({.phi1_rate = 3, .phi2_rate = 4, .y_rate = 5}), 1);
}

TEST(SwingUpTaskTest, DescribesItself) {
  const TaskDescription d = standard_task("swing_up", R"({"time_limit_s": 3})")->description();
  EXPECT_EQ(d.input_dim, 1);
  EXPECT_EQ(d.output_dim, 1);
  EXPECT_EQ(d.reward_min, 0);
  EXPECT_EQ(d.reward_max, 1);
  EXPECT_EQ(d.time_limit_s, 3);
  EXPECT_TRUE(d.deterministic);
}

TEST(SwingUpTaskTest, APolicyThatFollowsTheSeriesGetsItsReward) {
  for (const char* settings : {R"({"plant": "rk4", "step_s": 0.005})", R"({"plant": "dopri5"})"}) {
    EXPECT_NEAR(
        evaluate(*standard_task("swing_up", settings), following(sim::kPublished), 0).reward(),
        .821, .002);
    EXPECT_GT(evaluate(*standard_task("swing_up", settings), following(sim::kRefined), 0).reward(),
              .99);
  }
  EXPECT_NEAR(evaluate(*standard_task("swing_up", "{}"), following(sim::kPublished), 0).reward(),
              .821, .02);
}

/// Nothing moves: the start, the worst of states at rest, is also the best one.
TEST(SwingUpTaskTest, APolicyThatDoesNothingGetsTheRewardOfTheStart) {
  for (const char* settings : {R"({"plant": "ode"})", R"({"plant": "rk4"})"}) {
    EXPECT_NEAR(evaluate(*standard_task("swing_up", settings), line(0, 0), 0).reward(),
                std::exp(-.25 * 10), 1e-6);
  }
}

TEST(SwingUpTaskTest, TheStartCounts) {
  const auto upright =
      standard_task("swing_up", R"({"start_phi1": 0, "start_phi2": 0, "plant": "rk4"})");
  EXPECT_EQ(evaluate(*upright, line(8, 0), 0).reward(), 1);
}

TEST(SwingUpTaskTest, AlphaAndDurationComeFromTheSettings) {
  const double reward =
      evaluate(*standard_task("swing_up", R"({"plant": "rk4"})"), line(3, -2), 0).reward();
  const double steeper =
      evaluate(*standard_task("swing_up", R"({"plant": "rk4", "alpha": 0.5})"), line(3, -2), 0)
          .reward();
  EXPECT_NEAR(steeper, reward * reward, 1e-12);
  const double brief =
      evaluate(*standard_task("swing_up", R"({"plant": "rk4", "duration_s": 0.001})"), line(3, -2),
               0)
          .reward();
  EXPECT_NEAR(brief, std::exp(-.25 * 10), 1e-4);
}

TEST(SwingUpTaskTest, TheSamePolicyGetsTheSameBitsWhateverWasEvaluatedBefore) {
  for (const char* settings : {R"({"plant": "ode"})", R"({"plant": "rk4"})"}) {
    const auto task = standard_task("swing_up", settings);
    const double first = evaluate(*task, line(3, -2), 1).reward();
    (void)evaluate(*task, line(-5, 4), 2);
    EXPECT_EQ(evaluate(*task, line(3, -2), 3).reward(), first);
    EXPECT_EQ(evaluate(*standard_task("swing_up", settings), line(3, -2), 4).reward(), first);
  }
}

TEST(SwingUpTaskTest, ADivergedSimulationHasAStatusAndNoReward) {
  for (const char* settings :
       {R"({"plant": "ode", "step_s": 0.1})", R"({"plant": "dopri5", "steps_max": 1})"}) {
    const Outcome evaluation = evaluate(*standard_task("swing_up", settings), line(1e5, 1e5), 0);
    EXPECT_EQ(evaluation.status(), RolloutStatus::kDiverged) << settings;
    EXPECT_EQ(evaluation.reward(), 0) << settings;
  }
}

TEST(SwingUpTaskTest, SaysWhatIsWrongWithItsSettings) {
  EXPECT_EQ(refusal("swing_up", R"({"alpha": 0})"),
            "task.alpha = 0: must be a finite number above 0");
  EXPECT_NE(refusal("swing_up", R"({"duration_s": 1e9})").find("task.duration_s"),
            std::string::npos);
  EXPECT_NE(
      refusal("swing_up", R"({"plant": "mujoco"})").find("task.plant = \"mujoco\": must be one of"),
      std::string::npos);
  EXPECT_NE(refusal("swing_up", R"({"parameters": {"m2": "heavy"}})")
                .find("task.parameters.m2 = \"heavy\""),
            std::string::npos);
}

}  // namespace
}  // namespace treeroll
