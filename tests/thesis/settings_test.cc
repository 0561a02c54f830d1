#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "learner/fit/demonstration.h"
#include "learner/fit/fit_tree.h"
#include "learner/study/study_file.h"
#include "tests/fit/start_tree.h"
#include "tests/thesis/studies.h"

/// Sections 4-1-1, 4-2-1, 4-3-1 and A-4-3: tasks and starts of the shipped studies, number by
/// number. Their exploration, tables 4-1 to 4-3 and A-1, is held by shipped_studies_test; noise
/// entries of the tables are variances. Goals, start and sampling of experiments I and II stand in
/// the thesis's figures alone: these numbers are the ones that give its curves.
namespace treeroll {
namespace {

using nlohmann::json;

constexpr double kTolerance = 1e-12;

Study study(const std::string& name) { return load_study(kStudies / (name + ".toml"), {}).study; }

json task_settings(const Condition& condition, const std::string& task) {
  const json content = json::parse(condition.task_content);
  EXPECT_EQ(content.at("name"), task);
  return content.at("settings");
}

/// K Gaussians over time, equally spaced from 0 to `duration`, at position 0 and without coupling.
void expect_equally_spaced(const Gmm& gmm, int num_components, double duration, double sigma_t) {
  ASSERT_EQ(gmm.num_components(), num_components);
  ASSERT_EQ(gmm.dim(), 2);
  for (int k = 0; k < num_components; ++k) {
    EXPECT_NEAR(gmm[k].prior, 1. / num_components, kTolerance);
    EXPECT_NEAR(gmm[k].mean[0], (k + .5) * duration / num_components, kTolerance);
    EXPECT_EQ(gmm[k].mean[1], 0);
    EXPECT_NEAR(gmm[k].covariance(0, 0), sigma_t * sigma_t, kTolerance);
    EXPECT_EQ(gmm[k].covariance(1, 0), 0);
    EXPECT_NEAR(gmm[k].covariance(1, 1), .3 * .3, kTolerance);
  }
}

void expect_start(const Condition& condition, double duration) {
  const TreeModel& start = tree_policy(*condition.start).tree();
  expect_equally_spaced(start.finest(), 4, duration, duration / 8);
  if (start.num_layers() == 1) return;
  expect_equally_spaced(start.layer(1), 2, duration, std::numbers::sqrt2 * duration / 8);
  EXPECT_EQ(start.parents(2), (std::vector<int>{0, 0, 1, 1}));
}

json expected_goal(double sigma_t, const std::vector<double>& outputs) {
  return {{"deviations", {sigma_t, .3}}, {"outputs", outputs}};
}

TEST(SettingsTest, Section411TheFourGoalsAndTheStartOfExperimentI) {
  // Figure 4-1: Gaussians in two groups of two, or not; with an offset of 1.
  const std::map<std::string, std::vector<double>> outputs = {
      {"single", {.5, -.5, .5, -.5}},
      {"single_offset", {1.5, .5, 1.5, .5}},
      {"multi", {1.25, .75, -.75, -1.25}},
      {"multi_offset", {2.25, 1.75, .25, -.25}}};
  for (const char* name : {"thesis_4_1", "thesis_4_1_minimum_noise", "thesis_4_1_initial_noise",
                           "thesis_4_1_reuse", "thesis_window"}) {
    for (const Condition& condition : study(name).conditions) {
      SCOPED_TRACE(name + (": " + condition.name));
      const json settings = task_settings(condition, "trajectory");
      EXPECT_EQ(settings.at("alpha"), 20);
      EXPECT_EQ(settings.at("duration_s"), 2);
      EXPECT_EQ(settings.at("samples"), 100);
      const std::string goal = condition.name.substr(0, condition.name.find('.'));
      EXPECT_EQ(settings.at("goal"), expected_goal(.25, outputs.at(goal)));
      expect_start(condition, 2);
    }
  }
}

TEST(SettingsTest, Section421TheTwoGoalsAndTheStartOfExperimentII) {
  const std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> goals = {
      {"single", {{.5, -.5, .5, -.5}, {.3, -.3, .3, -.3}}},
      {"multi", {{1.25, .75, -.75, -1.25}, {.3, .3, -.3, -.3}}}};
  for (const char* name :
       {"thesis_4_2", "thesis_4_2_minimum_noise", "thesis_4_2_initial_noise", "thesis_frames"}) {
    for (const Condition& condition : study(name).conditions) {
      SCOPED_TRACE(name + (": " + condition.name));
      const json settings = task_settings(condition, "trajectory");
      EXPECT_EQ(settings.at("alpha"), 20);
      EXPECT_EQ(settings.at("duration_s"), 4);
      EXPECT_EQ(settings.at("samples"), 100);
      const auto& [outputs, psi] = goals.at(condition.name.substr(0, condition.name.find('.')));
      json goal = expected_goal(.5, outputs);
      goal["psi"] = psi;
      EXPECT_EQ(settings.at("goal"), goal);
      expect_start(condition, 4);
    }
  }
}

TEST(SettingsTest, Section431TheDemonstrationTheFitsAndTheReward) {
  // (4-4): T and p_1 .. p_4. The regularisation is ours, the thesis prints none.
  const Eigen::MatrixXd data =
      demonstrate({.duration_s = 2.2, .num_samples = 200, .p_m = {-.106, -.185, .092, .134}});
  FitSettings fit;
  fit.em.regularisation = Eigen::Vector2d(1e-3, 1);
  const TreeModel flat = fit_flat(data, 4, fit);
  const TreeModel tree = fit_bottom_up(data, 2, 2, fit);
  for (const Condition& condition : study("thesis_4_3").conditions) {
    SCOPED_TRACE(condition.name);
    const json settings = task_settings(condition, "swing_up");
    EXPECT_EQ(settings.at("alpha"), .25);       // table 4-3, (4-7)
    EXPECT_EQ(settings.at("duration_s"), 2.5);  // "simulation ... for 2.5 [s]"
    const bool is_ode = condition.name.ends_with(".ode");
    EXPECT_EQ(settings.at("plant"), is_ode ? "ode" : "rk4");
    EXPECT_EQ(settings.at("step_s"), is_ode ? .001 : .005);
    if (condition.name.starts_with("top_down_tree")) continue;  // not the thesis's
    const bool is_flat = condition.name.starts_with("flat");
    const TreeModel& expected = is_flat ? flat : tree;
    const TreeModel& start = tree_policy(*condition.start).tree();
    ASSERT_EQ(start.num_layers(), expected.num_layers());
    for (int layer = 1; layer <= expected.num_layers(); ++layer) {
      ASSERT_EQ(start.layer(layer).num_components(), 2 * (is_flat ? 2 : layer));
      for (int k = 0; k < expected.layer(layer).num_components(); ++k) {
        EXPECT_EQ(start.layer(layer)[k].mean, expected.layer(layer)[k].mean);
        EXPECT_EQ(start.layer(layer)[k].covariance, expected.layer(layer)[k].covariance);
      }
    }
  }
}

TEST(SettingsTest, SectionA43TheSpiralAndItsSixGaussians) {
  const Study spiral = study("spiral");
  EXPECT_EQ(spiral.repetitions, 30);
  for (const Condition& condition : spiral.conditions) {
    SCOPED_TRACE(condition.name);
    const json settings = task_settings(condition, "spiral");
    EXPECT_EQ(settings.at("alpha"), 5);  // of
    EXPECT_NEAR(settings.at("duration"), 5 * std::numbers::pi, kTolerance);
    EXPECT_EQ(condition.exploration.initial_noise_factor, 1);
    const Gmm gmm = tree_policy(*condition.start).tree().finest();
    ASSERT_EQ(gmm.num_components(), 6);
    for (int k = 0; k < 6; ++k) {  // whose k counts from 1
      EXPECT_NEAR((gmm[k].mean - Eigen::Vector3d(k * std::numbers::pi, 0, 0)).norm(), 0,
                  kTolerance);
      const Eigen::Matrix3d covariance = Eigen::Vector3d(.5, .05, .05).asDiagonal();
      EXPECT_NEAR((gmm[k].covariance - covariance).norm(), 0, kTolerance);
      EXPECT_NEAR(gmm[k].prior, 1. / 6, kTolerance);
    }
  }
}

}  // namespace
}  // namespace treeroll
