#include "workers/tasks/synthetic_task.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <ctime>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "tests/tasks/rollouts.h"
#include "tests/tasks/standard_task.h"

namespace treeroll {
namespace {

using nlohmann::json;

Gmm wide_line(double input, double output, double slope) {
  Eigen::Matrix2d covariance;
  covariance << 2, 2 * slope, 2 * slope, 2 * slope * slope + 1;
  return Gmm(1, {{.prior = 1, .mean = Eigen::Vector2d(input, output), .covariance = covariance}});
}

TEST(SyntheticTaskTest, RewardIsHighestAtTheTargetAndFallsWithTheDistance) {
  const auto task = standard_task("synthetic", R"({"target": [1, 2, 3], "sensitivity": 0.5})");
  EXPECT_DOUBLE_EQ(evaluate(*task, wide_line(1, 2, 3), 0).reward(), 1);
  EXPECT_DOUBLE_EQ(evaluate(*task, wide_line(1, 4, 3), 0).reward(), std::exp(-.5 * 4));
  // A slope that is 1 too steep misses by the distance: -1, -.5, 0, .5, 1.
  EXPECT_DOUBLE_EQ(evaluate(*task, wide_line(1, 2, 4), 0).reward(), std::exp(-.5 * 2.5 / 5));
  EXPECT_EQ(evaluate(*task, wide_line(1, 2, 1e4), 0).reward(), 0);
}

TEST(SyntheticTaskTest, AsksThePolicyForNoMoreThanItsOutputs) {
  const auto task = standard_task("synthetic", R"({"target": [0, 0, 0]})");
  const Component near = wide_line(0, .5, 0)[0], far = wide_line(3, .5, 0)[0];
  EXPECT_DOUBLE_EQ(evaluate(*task, Gmm(1, {near, far}), 0).reward(), std::exp(-.25));
}

TEST(SyntheticTaskTest, TakesAnyDimensions) {
  const auto task = standard_task("synthetic", R"({"input_dim": 2, "output_dim": 3})");
  EXPECT_EQ(task->description().input_dim, 2);
  EXPECT_EQ(task->description().output_dim, 3);
  const Gmm policy(2, {{.prior = 1,
                        .mean = Eigen::VectorXd::Ones(5),
                        .covariance = Eigen::MatrixXd::Identity(5, 5)}});
  EXPECT_DOUBLE_EQ(evaluate(*task, policy, 0).reward(), std::exp(-.5));  // slopes are 0, not 1
}

/// How many of 2000 policies come back with this status.
int count(Task& task, RolloutStatus status) {
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    found += evaluate(task, wide_line(0, .001 * i, 0), 0).status() == status ? 1 : 0;
  }
  return found;
}

TEST(SyntheticTaskTest, FailsForTheShareItIsToldAndForTheSamePoliciesEachTime) {
  const auto task = standard_task("synthetic", R"({"fail_fraction": 0.1})"),
             other = standard_task("synthetic", R"({"fail_fraction": 0.1})");
  EXPECT_NEAR(count(*task, RolloutStatus::kFailed), 200, 60);
  for (int i = 0; i < 200; ++i) {
    const Gmm policy = wide_line(0, .001 * i, 0);
    const Outcome first = evaluate(*task, policy, 1);
    EXPECT_EQ(first.status(), evaluate(*other, policy, 2).status());
    if (first.status() == RolloutStatus::kFailed) {
      EXPECT_EQ(first.reward(), 0);
    }
  }
  EXPECT_EQ(count(*standard_task("synthetic", "{}"), RolloutStatus::kOk), 2000);
  EXPECT_EQ(count(*standard_task("synthetic", R"({"fail_fraction": 1})"), RolloutStatus::kFailed),
            2000);
}

TEST(SyntheticTaskDeathTest, CrashesBySegmentationFault) {
  const auto task = standard_task("synthetic", R"({"crash_fraction": 1})");
  EXPECT_EXIT((void)evaluate(*task, wide_line(0, 0, 0), 0), ::testing::KilledBySignal(SIGSEGV), "");
}

/// Ended by an alarm: it would not come back by itself.
void evaluate_until_alarm(Task& task) {
  std::signal(SIGALRM, SIG_DFL);
  timer_t timer{};
  timer_create(CLOCK_MONOTONIC, nullptr, &timer);
  itimerspec soon{};
  soon.it_value.tv_nsec = 50'000'000;
  timer_settime(timer, 0, &soon, nullptr);
  (void)evaluate(task, wide_line(0, 0, 0), 0);
}

TEST(SyntheticTaskDeathTest, HangsForEver) {
  for (const char* settings :
       {R"({"hang_fraction": 1, "mode": "sleep"})", R"({"hang_fraction": 1, "mode": "burn"})"}) {
    const auto task = standard_task("synthetic", settings);
    EXPECT_EXIT(evaluate_until_alarm(*task), ::testing::KilledBySignal(SIGALRM), "");
  }
}

TEST(SyntheticTaskTest, BurnsProcessorTimeAndSleepsWithout) {
  const auto used_us = [](const char* settings) {
    const auto task = standard_task("synthetic", settings);
    timespec before{}, after{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before);
    (void)evaluate(*task, wide_line(0, 0, 0), 0);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after);
    return (after.tv_sec - before.tv_sec) * 1e6 + (after.tv_nsec - before.tv_nsec) / 1e3;
  };
  EXPECT_GE(used_us(R"({"duration_us": 20000})"), 20000);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_LT(used_us(R"({"duration_us": 20000, "mode": "sleep"})"), 15000);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::microseconds(20000));
}

TEST(SyntheticTaskTest, NoiseFollowsTheSeedAndIsDeclared) {
  const auto task = standard_task("synthetic", R"({"target": [0, 0, 0], "noise_deviation": 0.1})");
  EXPECT_FALSE(task->description().deterministic);
  EXPECT_TRUE(standard_task("synthetic", "{}")->description().deterministic);
  const Gmm policy = wide_line(1, 1, 0);
  const double clean = std::exp(-1.);
  std::set<double> rewards;
  double sum = 0, sum_squares = 0;
  for (int seed = 0; seed < 1000; ++seed) {
    const double reward = evaluate(*task, policy, seed).reward();
    EXPECT_EQ(evaluate(*task, policy, seed).reward(), reward);
    rewards.insert(reward);
    sum += reward - clean;
    sum_squares += (reward - clean) * (reward - clean);
  }
  EXPECT_EQ(rewards.size(), 1000U);
  EXPECT_NEAR(sum / 1000, 0, .015);
  EXPECT_NEAR(std::sqrt(sum_squares / 1000), .1, .01);
}

TEST(SyntheticTaskTest, NoiseKeepsTheRewardInItsRange) {
  const auto task = standard_task("synthetic", R"({"target": [0, 0, 0], "noise_deviation": 1})");
  for (int seed = 0; seed < 200; ++seed) {
    const double reward = evaluate(*task, wide_line(0, 0, 0), seed).reward();
    EXPECT_GE(reward, 0);
    EXPECT_LE(reward, 1);
  }
}

TEST(SyntheticTaskTest, SaysWhatIsWrongWithItsSettings) {
  EXPECT_EQ(refusal("synthetic", R"({"input_dim": 0})"),
            "task.input_dim = 0: must be an integer from 1 to 64");
  EXPECT_NE(refusal("synthetic", R"({"target": [1]})").find("must hold 3 numbers"),
            std::string::npos);
  EXPECT_NE(refusal("synthetic", R"({"mode": "idle"})").find("must be one of: burn, sleep"),
            std::string::npos);
  EXPECT_NE(refusal("synthetic", R"({"fail_fraction": 0.6, "hang_fraction": 0.6})")
                .find("must be at most 1 together with the other fractions"),
            std::string::npos);
  EXPECT_NE(refusal("synthetic", R"({"crash_fraction": -0.1})").find("task.crash_fraction = -0.1"),
            std::string::npos);
}

}  // namespace
}  // namespace treeroll
