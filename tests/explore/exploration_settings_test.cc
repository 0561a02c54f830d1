#include "learner/explore/exploration_settings.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/base/config_error.h"
#include "common/settings/settings_reader.h"
#include "learner/explore/cem_rule.h"
#include "learner/explore/cma_es_rule.h"
#include "learner/explore/pi2_rule.h"
#include "trees.h"

namespace treeroll::explore {
namespace {

using nlohmann::json;

ExplorationSettings read(const json& table, json& resolved,
                         ThetaLayout layout = ThetaLayout::kMeansCholesky) {
  SettingsReader reader(table, "exploration", resolved);
  ExplorationSettings settings =
      read_exploration_settings(reader, TreePolicy(two_layer_tree(), 1, layout));
  reader.finish();
  return settings;
}

const json kTable = {{"noise_variance", {.01, .3, .02}}};

TEST(ExplorationSettingsTest, DefaultsToTable43AndToEveryLayerOfTheTree) {
  json resolved;
  const ExplorationSettings settings = read(kTable, resolved);
  ExplorationSettings expected;
  expected.rule = PowerSettings{.first_update = 10,
                                .best_considered = 2,
                                .minimum_noise = {.fraction = 5e-3, .decay_start = 0}};
  expected.convergence_window = 20;
  expected.convergence_slope = 0;
  expected.noise_variance = {.01, .3, .02};
  expected.initial_noise_factor = 1;
  expected.reuse = true;
  expected.first_layer = 1;
  expected.last_layer = 2;
  EXPECT_EQ(settings, expected);
}

TEST(ExplorationSettingsTest, ReadsEveryKey) {
  const json table = {{"rule", "power"},
                      {"first_update", 6},
                      {"best_considered", 5},
                      {"convergence_window", 10},
                      {"convergence_slope", 1e-3},
                      {"convergence_gain", .3},
                      {"noise_variance", {.1, 1}},
                      {"initial_noise_factor", .03},
                      {"minimum_noise_fraction", .02},
                      {"minimum_noise_decay_start", 50},
                      {"minimum_noise_decay_power", 2},
                      {"reuse", false},
                      {"first_layer", 2},
                      {"last_layer", 2}};
  json resolved;
  const ExplorationSettings settings = read(table, resolved, ThetaLayout::kMeans);
  ExplorationSettings expected;
  expected.rule =
      PowerSettings{.first_update = 6,
                    .best_considered = 5,
                    .minimum_noise = {.fraction = .02, .decay_start = 50, .decay_power = 2}};
  expected.convergence_window = 10;
  expected.convergence_slope = 1e-3;
  expected.convergence_gain = .3;
  expected.noise_variance = {.1, 1};
  expected.initial_noise_factor = .03;
  expected.reuse = false;
  expected.first_layer = 2;
  expected.last_layer = 2;
  EXPECT_EQ(settings, expected);
  json complete = table;
  complete["stop_on_convergence"] = false;
  EXPECT_EQ(resolved, complete);
}

TEST(ExplorationSettingsTest, ReadsTheKeysOfEachRule) {
  json resolved;
  json table = {{"rule", "pi2"},        {"noise_variance", {.1, 1}},
                {"population", 30},     {"generation", "stale"},
                {"eliteness", 7},       {"covariance_learning_rate", .25},
                {"noise_decay", .9},    {"minimum_noise_fraction", 0},
                {"stop_at_reward", .9}, {"stop_on_convergence", true}};
  ExplorationSettings pi2;
  pi2.rule = Pi2Settings{.generation = {.population = 30, .complete = false},
                         .eliteness = 7,
                         .noise = {.learning_rate = .25, .decay = .9, .minimum = {.fraction = 0}}};
  pi2.noise_variance = {.1, 1};
  pi2.stop_at_reward = .9;
  pi2.stop_on_convergence = true;
  pi2.last_layer = 2;
  EXPECT_EQ(read(table, resolved, ThetaLayout::kMeans), pi2);

  ExplorationSettings cem;
  cem.rule = CemSettings{
      .generation = {.population = 4}, .elites = 3, .noise = {.minimum = {.fraction = 0}}};
  cem.noise_variance = {.1, 1};
  cem.last_layer = 2;
  table = {{"rule", "cem"}, {"noise_variance", {.1, 1}}, {"population", 4}, {"elites", 3}};
  EXPECT_EQ(read(table, resolved, ThetaLayout::kMeans), cem);

  ExplorationSettings cma_es;
  cma_es.rule = CmaEsRuleSettings{
      .generation = {.population = 12}, .active = false, .mirrored = false, .rate_factor = 5};
  cma_es.initial_step = .1;
  cma_es.last_layer = 2;
  table = {{"rule", "cma_es"}, {"active", false},    {"mirrored", false},
           {"rate_factor", 5}, {"initial_step", .1}, {"coordinates", "sensitivity"}};
  EXPECT_EQ(read(table, resolved, ThetaLayout::kMeans), cma_es);
  json of_cma_es;
  read(table, of_cma_es, ThetaLayout::kMeans);
  json resolved_again;
  EXPECT_EQ(read(of_cma_es, resolved_again, ThetaLayout::kMeans), cma_es);
}

TEST(ExplorationSettingsTest, RefusesTheKeysOfAnotherRule) {
  struct Case {
    const char* rule;
    const char* key;
    json value;
  };
  for (const Case& of :
       {Case{"power", "population", 20}, Case{"power", "generation", "stale"},
        Case{"pi2", "first_update", 5}, Case{"pi2", "elites", 5}, Case{"cem", "eliteness", 10},
        Case{"cem", "active", true}, Case{"cma_es", "minimum_noise_fraction", .1},
        Case{"cma_es", "initial_step", .1}, Case{"cma_es", "noise_decay", .9}}) {
    json table = kTable;
    table["rule"] = of.rule;
    table[of.key] = of.value;
    json resolved;
    EXPECT_THROW(read(table, resolved), ConfigError) << of.rule << ' ' << of.key;
  }
  json resolved;
  EXPECT_THROW(
      read({{"rule", "cma_es"}, {"coordinates", "sensitivity"}, {"noise_variance", {.01, .3, .02}}},
           resolved),
      ConfigError);
  EXPECT_THROW(
      read({{"rule", "cem"}, {"population", 4}, {"elites", 5}, {"noise_variance", {.01, .3, .02}}},
           resolved),
      ConfigError);
}

TEST(ExplorationSettingsTest, GivesTheSameAgainFromWhatItResolved) {
  json resolved;
  const ExplorationSettings settings = read(kTable, resolved);
  json resolved_again;
  EXPECT_EQ(read(resolved, resolved_again), settings);
  EXPECT_EQ(resolved_again, resolved);
}

TEST(ExplorationSettingsTest, NamesKeyAndRuleOfWhatItRefuses) {
  struct Case {
    const char* key;
    json value;
    const char* error;
  };
  const Case cases[] = {
      {"rule", "cma", "exploration.rule = \"cma\": must be one of: auto, power, pi2, cem, cma_es"},
      {"first_update", 0, "exploration.first_update = 0: must be an integer from 1 to 1000000000"},
      {"best_considered", 11,
       "exploration.best_considered = 11: must be at most first_update, which is 10"},
      {"best_considered", 0, "exploration.best_considered = 0: must be an integer from 1 to 1000"},
      {"convergence_window", 1,
       "exploration.convergence_window = 1: must be an integer from 2 to 100000"},
      {"convergence_slope", "low",
       "exploration.convergence_slope = \"low\": must be a finite number"},
      {"convergence_gain", 0,
       "exploration.convergence_gain = 0: must be a finite number above 0 and at most 1"},
      {"noise_variance", {.01, .3}, "exploration.noise_variance = [0.01,0.3]: must hold 3 numbers"},
      {"noise_variance",
       {.01, -.3, .02},
       "exploration.noise_variance = [0.01,-0.3,0.02]: each number of the list must be a finite "
       "number of at least 1e-30 and at most 1e+30"},
      {"initial_noise_factor", 0,
       "exploration.initial_noise_factor = 0: must be a finite number of at least 1e-12 and at "
       "most 1000000000000"},
      {"minimum_noise_fraction", -1,
       "exploration.minimum_noise_fraction = -1: must be a finite number of at least 1e-12 and at "
       "most 1000000000000"},
      {"minimum_noise_decay_start", -1,
       "exploration.minimum_noise_decay_start = -1: must be an integer from 0 to 1000000000"},
      {"minimum_noise_decay_power", 0,
       "exploration.minimum_noise_decay_power = 0: must be a finite number above 0 and at most 10"},
      {"reuse", 1, "exploration.reuse = 1: must be true or false"},
      {"first_layer", 3, "exploration.first_layer = 3: must be an integer from 1 to 2"},
      {"last_layer", 3, "exploration.last_layer = 3: must be an integer from 1 to 2"},
  };
  for (const Case& bad : cases) {
    json table = kTable;
    table[bad.key] = bad.value;
    try {
      json resolved;
      read(table, resolved);
      ADD_FAILURE() << bad.key << " = " << bad.value << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_STREQ(error.what(), bad.error);
    }
  }
}

TEST(ExplorationSettingsTest, RefusesLayersInTheWrongOrderAndAMissingNoise) {
  json resolved;
  json table = kTable;
  table["first_layer"] = 2;
  table["last_layer"] = 1;
  try {
    read(table, resolved);
    ADD_FAILURE();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "exploration.last_layer = 1: must be at least first_layer, which is 2");
  }
  EXPECT_THROW(read({{"rule", "power"}}, resolved), ConfigError);  // from nothing, without a scale
}

TEST(MinimumNoiseDecayTest, StartsAfterItsStartWithItsPower) {
  MinimumNoise minimum;
  EXPECT_EQ(minimum_noise_decay(minimum, 1'000'000), 1);
  minimum.decay_start = 50;
  EXPECT_EQ(minimum_noise_decay(minimum, 1), 1);
  EXPECT_EQ(minimum_noise_decay(minimum, 50), 1);
  EXPECT_NEAR(minimum_noise_decay(minimum, 51), 50. / 51, 1e-15);
  EXPECT_NEAR(minimum_noise_decay(minimum, 200), .25, 1e-15);
  minimum.decay_power = 2;
  EXPECT_NEAR(minimum_noise_decay(minimum, 200), .0625, 1e-15);
}

}  // namespace
}  // namespace treeroll::explore
