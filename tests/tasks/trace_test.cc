#include "workers/tasks/trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/elementary.h"
#include "workers/tasks/task.h"

namespace treeroll {
namespace {

using nlohmann::json;

std::unique_ptr<Task> make(const std::string& name, const char* settings) {
  TaskRegistry registry;
  add_standard_tasks(registry);
  json resolved;
  return registry.make(name, json::parse(settings), resolved);
}

/// One line: acceleration 3 - 2 t.
Gmm line() {
  Eigen::Matrix2d covariance;
  covariance << 1, -2, -2, 4.1;
  return Gmm(1, {{.prior = 1, .mean = Eigen::Vector2d(0, 3), .covariance = covariance}});
}

TEST(TraceTest, TheLeastCostOfASwingUpsTraceGivesItsRewardToTheBit) {
  for (const char* settings : {R"({"plant": "ode"})", R"({"plant": "rk4", "step_s": 0.005})",
                               R"({"plant": "dopri5", "output_step_s": 0.01})"}) {
    const auto task = make("swing_up", settings);
    Trace trace;
    const Evaluation traced = task->evaluate_traced(line(), 0, trace);
    EXPECT_EQ(traced.reward, task->evaluate(line(), 0).reward) << settings;
    const std::size_t width = trace.columns().size();
    ASSERT_EQ(width, 9U);
    ASSERT_EQ(trace.numbers().size() % width, 0U);
    const auto at = [&](std::size_t row, std::size_t column) {
      return trace.numbers()[row * width + column];
    };
    const std::size_t num_rows = trace.numbers().size() / width;
    double cost_min = at(0, 8);
    for (std::size_t row = 1; row < num_rows; ++row) {
      cost_min = std::min(cost_min, at(row, 8));
      EXPECT_GT(at(row, 0), at(row - 1, 0)) << "time goes on";
      EXPECT_NEAR(at(row, 7), 3 - 2 * at(row, 0), 1e-9) << "the input is the policy's";
    }
    EXPECT_EQ(elementary::exp(-.25 * cost_min), traced.reward) << settings;
    EXPECT_EQ(at(0, 1), -M_PI);
    EXPECT_NEAR(at(num_rows - 1, 0), 2.5, 1e-9);
  }
}

TEST(TraceTest, ADivergedSwingUpIsTracedAsFarAsItWent) {
  const auto task = make("swing_up", R"({"plant": "dopri5", "steps_max": 100})");
  Trace trace;
  EXPECT_EQ(task->evaluate_traced(line(), 0, trace).status, RolloutStatus::kDiverged);
  EXPECT_GT(trace.numbers().size(), 0U);
}

TEST(TraceTest, ATaskThatDoesNotOverrideItRecordsNothing) {
  const auto task = make("synthetic", "{}");
  Trace trace;
  EXPECT_EQ(task->evaluate_traced(line(), 0, trace).reward, task->evaluate(line(), 0).reward);
  EXPECT_TRUE(trace.columns().empty());
  EXPECT_TRUE(trace.is_complete());
}

TEST(TraceTest, MoreNumbersThanItMayHoldAreNotKeptAndItSaysSo) {
  Trace trace;
  trace.set_columns({"time_s", "cost"});
  for (std::size_t row = 0; row < Trace::kNumbersMax / 2; ++row) trace.add_row({0, 1});
  EXPECT_TRUE(trace.is_complete());
  trace.add_row({0, 1});
  EXPECT_FALSE(trace.is_complete());
  EXPECT_EQ(trace.numbers().size(), Trace::kNumbersMax);
}

TEST(TraceDeathTest, ARowHasANumberForEachColumn) {
  Trace trace;
  EXPECT_DEATH(trace.add_row({1}), "a number for each column");
  trace.set_columns({"time_s", "cost"});
  EXPECT_DEATH(trace.add_row({1}), "a number for each column");
}

}  // namespace
}  // namespace treeroll
