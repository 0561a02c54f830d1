// What it takes to add an update rule: this folder, and one line of registration.
#include "tests/explore/hill_climber/hill_climber.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "tests/explore/trees.h"

namespace treeroll::explore {
namespace {

using nlohmann::json;

ExplorationSettings read_climber(const json& table, json& resolved) {
  const auto standard = standard_update_rules();
  std::vector<UpdateRuleKind> rules(standard.begin(), standard.end());
  rules.push_back({"hill_climber", read_hill_climber});
  SettingsReader reader(table, "exploration", resolved);
  ExplorationSettings settings = read_exploration_settings(
      reader, TreePolicy(two_layer_tree(), 1, ThetaLayout::kMeans), rules);
  reader.finish();
  return settings;
}

ExplorationSettings read_climber(const json& table) {
  json resolved;
  return read_climber(table, resolved);
}

const json kClimberTable = {
    {"rule", "hill_climber"}, {"noise_variance", {.01, .04}}, {"boldness", 1.4}};

std::string refusal_of_climber(const json& table) {
  try {
    read_climber(table);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(HillClimberTest, IsReadFromAStudyWithItsOwnSettings) {
  json resolved;
  const ExplorationSettings settings = read_climber(kClimberTable, resolved);
  EXPECT_EQ(settings.rule, HillClimberSettings{.boldness = 1.4});
  EXPECT_NE(settings.rule, HillClimberSettings{});
  EXPECT_NE(settings.rule, PowerSettings{});
  EXPECT_EQ(resolved.at("boldness"), 1.4);
  EXPECT_EQ(read_climber(resolved), settings);

  json bad = kClimberTable;
  bad["boldness"] = 1;
  EXPECT_EQ(refusal_of_climber(bad),
            "exploration.boldness = 1: must be a finite number above 1 and at most 10");
  bad = kClimberTable;
  bad["first_update"] = 5;
  EXPECT_NE(refusal_of_climber(bad), "") << "another rule's key";
  bad["rule"] = "unheard";
  EXPECT_EQ(refusal_of_climber(bad),
            "exploration.rule = \"unheard\": must be one of: auto, power, pi2, cem, cma_es, "
            "hill_climber");
}

/// Of a quadratic in the output means, whatever the layer: moving a parent moves its children.
double reward(const Eigen::VectorXd& theta) {
  double square = 0;
  for (Eigen::Index i = 1; i < theta.size(); i += 2) square += (theta[i] - .5) * (theta[i] - .5);
  return 1 / (1 + square / static_cast<double>(theta.size()));
}

TEST(HillClimberTest, ClimbsAQuadraticThroughASwitchOfLayers) {
  ExplorationSettings settings = read_climber(kClimberTable);
  settings.num_rollouts = 400;
  Exploration run = run_over_means(settings, two_layer_tree());
  EXPECT_LT(reward(run.mean()), .9);
  double reward_left = 0;
  while (const std::optional<Draw> draw = run.ask()) {
    if (run.layer() == 1) reward_left = reward(run.mean());
    run.tell(draw->rollout, Outcome::ok(reward(draw->theta)));
  }
  ASSERT_EQ(run.switches().size(), 1U);
  EXPECT_EQ(run.mean().size(), 8);
  EXPECT_GT(reward_left, .9) << "layer 1";
  EXPECT_GT(reward(run.mean()), .9999) << "layer 2";
  EXPECT_EQ(run.best().layer, 2);
}

TEST(HillClimberTest, TheNextLayerGoesOnFromItsMeanWithTheInitialNoise) {
  ExplorationSettings settings = read_climber(kClimberTable);
  settings.convergence_slope = 1e9;
  Exploration run = run_over_means(settings, two_layer_tree());
  for (int i = 0; run.layer() == 1; ++i) {
    const Draw draw = *run.ask();
    run.tell(i, Outcome::ok(reward(draw.theta)));
  }
  EXPECT_EQ(run.noise(), Eigen::Vector2d(.01, .04).replicate(4, 1).asDiagonal().toDenseMatrix());
  EXPECT_EQ(run.mean(), run.policy(2).theta());
  EXPECT_EQ(run.switches(), std::vector<int>{19});
}

}  // namespace
}  // namespace treeroll::explore
