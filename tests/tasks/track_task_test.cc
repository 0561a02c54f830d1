#include "workers/tasks/track_task.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/numbers/elementary.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"

namespace treeroll {
namespace {

using ::testing::HasSubstr;

/// Gives the acceleration of the path itself.
class PathController final : public Controller {
 public:
  int input_dim() const override { return 1; }
  int output_dim() const override { return 1; }
  using Controller::act;
  void act(std::span<const double> input, std::span<double> output) override {
    const double rate = std::numbers::pi / 4;
    output[0] = -.3 * rate * rate * elementary::cos(rate * input[0]) +
                .05 * 4 * rate * rate * elementary::cos(2 * rate * input[0]);
  }
};

TEST(TrackTaskTest, ThePathItselfIsWorthAllWhateverThePlant) {
  for (const char* plant :
       {R"({"plant": "rk4", "step_s": 0.005})", R"({"plant": "ode"})", R"({"plant": "dopri5"})"}) {
    PathController path;
    EXPECT_NEAR(standard_task("track", plant)->evaluate(path, 0).reward(), 1, 1e-9) << plant;
  }
}

/// Nothing moves: what is left is the path's own distance from where it began.
TEST(TrackTaskTest, ACartAtRestIsAsFarAsThePathAndTheAnglesGo) {
  const auto task =
      standard_task("track", R"({"plant": "rk4", "step_s": 0.005, "amplitudes": [0.01]})");
  const double reward = evaluate(*task, line(0, 0), 0).reward();
  // Slow and small: the cart alone counts, (.01 (cos - 1))^2 of mean 1.5e-4, a third of it.
  EXPECT_NEAR(-std::log(reward) / 5, 1.5e-4 / 3, .5e-4 / 3);
  const auto steeper = standard_task(
      "track", R"({"plant": "rk4", "step_s": 0.005, "amplitudes": [0.01], "alpha": 10})");
  EXPECT_NEAR(evaluate(*steeper, line(0, 0), 0).reward(), reward * reward, 1e-12);
}

TEST(TrackTaskTest, ItsTraceHasTheGoalsAndTheSameReward) {
  const auto task = standard_task("track", R"({"plant": "rk4", "step_s": 0.005})");
  Trace trace;
  const Outcome traced = evaluate_traced(*task, line(.2, -.1), 0, trace);
  EXPECT_EQ(traced.reward(), evaluate(*task, line(.2, -.1), 0).reward());
  ASSERT_EQ(trace.columns().size(), 11U);
  ASSERT_EQ(trace.numbers().size(), 11U * 801);
  EXPECT_NEAR(trace.numbers()[10], .25, 1e-15);          // y of the path, m
  EXPECT_NEAR(trace.numbers()[3], .25, 1e-15);           // where the cart begins
  EXPECT_NEAR(trace.numbers().back(), -.3 - .05, 1e-9);  // after half a turn
}

TEST(TrackTaskTest, ItsTraceShowsTheMotionUnlessTheLinksVary) {
  Trace trace;
  evaluate_traced(*standard_task("track", R"({"plant": "rk4", "step_s": 0.005})"), line(0, 0), 0,
                  trace);
  ASSERT_EQ(trace.poses().size(), 801U);
  EXPECT_NEAR(trace.poses()[0].at(1).front().x_m, .25, 1e-15);  // the cart's joint
  Trace of_varied;
  evaluate_traced(*standard_task("track", R"({"plant": "rk4", "step_s": 0.005,
                                              "variation": {"parameter_fraction": 0.1}})"),
                  line(0, 0), 0, of_varied);
  EXPECT_GT(of_varied.numbers().size(), 0U);
  EXPECT_TRUE(of_varied.poses().empty());
}

TEST(TrackTaskTest, RefusesASettingWithItsKey) {
  for (const auto& [settings, key] : {std::pair{R"({"amplitudes": []})", "amplitudes"},
                                      {R"({"amplitudes": [11]})", "amplitudes"},
                                      {R"({"alpha": 0})", "alpha"},
                                      {R"({"duration_s": 0})", "duration_s"},
                                      {R"({"amplitude": [1]})", "amplitude"}}) {
    EXPECT_THAT(refusal("track", settings), HasSubstr(key)) << settings;
  }
}

}  // namespace
}  // namespace treeroll
