#include "workers/tasks/plant_variation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "tests/tasks/rollouts.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

std::unique_ptr<Task> swing_up(const std::string& variation, const std::string& rest = "") {
  TaskRegistry registry;
  add_standard_tasks(registry);
  json resolved;
  return registry.make(
      "swing_up",
      json::parse(R"({"plant": "rk4", "step_s": 0.01, "variation": )" + variation + rest + "}"),
      resolved);
}

/// The reward of hold is a mean over time, and so depends on the plant whatever the policy does.
std::unique_ptr<Task> hold(const std::string& variation) {
  TaskRegistry registry;
  add_standard_tasks(registry);
  json resolved;
  return registry.make(
      "hold", json::parse(R"({"plant": "rk4", "step_s": 0.01, "variation": )" + variation + "}"),
      resolved);
}

TEST(PlantVariationTest, ATaskThatVariesSaysSoAndFollowsItsSeed) {
  const Gmm still(6, {{1, Eigen::VectorXd::Zero(7), Eigen::MatrixXd::Identity(7, 7)}});
  for (const char* variation :
       {R"({"parameter_fraction": 0.05})", R"({"start_deviation_rad": 0.1})"}) {
    const auto task = hold(variation);
    EXPECT_FALSE(task->description().deterministic);
    EXPECT_FALSE(swing_up(variation)->description().deterministic);
    const double first = evaluate(*task, still, 1).reward();
    EXPECT_NE(evaluate(*task, still, 2).reward(), first);
    EXPECT_EQ(evaluate(*task, still, 1).reward(), first);
    EXPECT_EQ(evaluate(*hold(variation), still, 1).reward(), first);
  }
  EXPECT_TRUE(swing_up("{}")->description().deterministic);
}

TEST(PlantVariationTest, NoVariationIsThePlantItself) {
  TaskRegistry registry;
  add_standard_tasks(registry);
  json resolved;
  const auto plain =
      registry.make("swing_up", json::parse(R"({"plant": "rk4", "step_s": 0.01})"), resolved);
  EXPECT_EQ(evaluate(*swing_up("{}"), line(3, -2), 7).reward(),
            evaluate(*plain, line(3, -2), 8).reward());
}

TEST(PlantVariationTest, TheRewardIsTheMeanOverTheEvaluations) {
  // A roll-out that ends at once has the reward of its start, so the mean can be had without one.
  const auto task = swing_up(R"({"evaluations": 5, "start_deviation_rad": 0.2})",
                             R"(, "duration_s": 1e-9, "start_phi1": 0.5, "start_phi2": 0)");
  const PlantVariation variation{.evaluations = 5, .start_deviation_rad = .2};
  double sum = 0;
  for (int i = 0; i < 5; ++i) {
    const auto start = varied(sim::CartPendulumState{.phi1 = .5}, variation, 3, i);
    sum += std::exp(-.25 * 5 / (M_PI * M_PI) * (start.phi1 * start.phi1 + start.phi2 * start.phi2));
  }
  EXPECT_NEAR(evaluate(*task, line(0, 0), 3).reward(), sum / 5, 1e-6);
}

TEST(PlantVariationTest, ParametersAreUniformWithinTheirFractionAndApartFromEachOther) {
  const PlantVariation variation{.evaluations = 1000, .parameter_fraction = .1};
  const sim::DoublePendulum nominal;
  double sum = 0, sum_squared = 0, sum_product = 0;
  constexpr int kNum = 4000;
  for (int i = 0; i < kNum; ++i) {
    const sim::DoublePendulum p = varied(nominal, variation, 1, i);
    const double l1 = p.l1 / nominal.l1 - 1, m2 = p.m2 / nominal.m2 - 1;
    EXPECT_LE(std::abs(l1), .1);
    EXPECT_LE(std::abs(m2), .1);
    EXPECT_EQ(p.gravity, nominal.gravity);
    EXPECT_EQ(p.d1, nominal.d1);
    sum += l1;
    sum_squared += l1 * l1;
    sum_product += l1 * m2;
  }
  EXPECT_NEAR(sum / kNum, 0, .004);
  EXPECT_NEAR(sum_squared / kNum, .01 / 3, 2e-4);  // variance of the uniform distribution
  EXPECT_NEAR(sum_product / kNum, 0, 2e-4);
}

TEST(PlantVariationTest, ADivergedEvaluationDecides) {
  const auto task = swing_up(R"({"evaluations": 3, "parameter_fraction": 0.05})", R"(,
      "parameters": {"m1": 1e-6, "m2": 1e6, "j1": 1e-6, "j2": 1e-6})");
  const Outcome evaluation = evaluate(*task, line(1e5, 1e5), 0);
  EXPECT_EQ(evaluation.status(), RolloutStatus::kDiverged);
  EXPECT_EQ(evaluation.reward(), 0);
}

TEST(PlantVariationTest, SaysWhatIsWrongWithItsSettings) {
  const auto error = [](const char* variation) -> std::string {
    try {
      (void)swing_up(variation);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(error(R"({"evaluations": 2})"),
              HasSubstr("task.variation.evaluations = 2: must be 1"));
  EXPECT_THAT(error(R"({"evaluations": 0})"), HasSubstr("task.variation.evaluations"));
  EXPECT_THAT(error(R"({"parameter_fraction": 1})"),
              HasSubstr("task.variation.parameter_fraction"));
  EXPECT_THAT(error(R"({"start_deviation_rad": -1})"),
              HasSubstr("task.variation.start_deviation_rad"));
  EXPECT_THAT(error(R"({"noise": 1})"), HasSubstr("task.variation.noise"));
}

}  // namespace
}  // namespace treeroll
