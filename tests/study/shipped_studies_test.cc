#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "learner/study/study_file.h"
#include "tests/fit/start_tree.h"
#include "tests/study/equal_studies.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

using testing::ElementsAre;

const std::filesystem::path kStudies = TREEROLL_STUDIES_DIR;

std::vector<std::string> names_of(const Study& study) {
  std::vector<std::string> names;
  for (const Condition& condition : study.conditions) names.push_back(condition.name);
  return names;
}

TEST(ShippedStudiesTest, Thesis43IsTable43) {
  const Study study = load_study(kStudies / "thesis_4_3.toml", {}).study;
  EXPECT_THAT(names_of(study), ElementsAre("flat.ode", "flat.rk4", "layer_1.ode", "layer_1.rk4",
                                           "layer_2.ode", "layer_2.rk4", "tree.ode", "tree.rk4",
                                           "top_down_tree.ode", "top_down_tree.rk4"));
  EXPECT_EQ(study.repetitions, 30);
  const int num_layers[] = {1, 2, 2, 2, 2};
  const int first_layer[] = {1, 1, 2, 1, 1};
  const int last_layer[] = {1, 1, 2, 2, 2};
  for (int plant = 0; plant < 10; ++plant) {
    const int i = plant / 2;
    const Condition& condition = study.conditions[plant];
    EXPECT_EQ(condition.start->num_layers(), num_layers[i]) << condition.name;
    EXPECT_EQ(tree_policy(*condition.start).tree().finest().num_components(), 4) << condition.name;
    EXPECT_EQ(tree_policy(*condition.start).layout(), ThetaLayout::kMeansCholesky);
    explore::ExplorationSettings table_4_3;
    table_4_3.num_rollouts = 200;
    table_4_3.rule = explore::PowerSettings{
        .first_update = 10, .best_considered = 2, .minimum_noise = {.fraction = 5e-3}};
    table_4_3.convergence_window = 20;
    table_4_3.convergence_slope = 0;
    table_4_3.noise_variance = {.01, .3, .02};
    table_4_3.initial_noise_factor = 1;
    table_4_3.first_layer = first_layer[i];
    table_4_3.last_layer = last_layer[i];
    EXPECT_EQ(condition.exploration, table_4_3) << condition.name;
  }
}

TEST(ShippedStudiesTest, Thesis41And42AreTables41And42) {
  const Study first = load_study(kStudies / "thesis_4_1.toml", {}).study;
  const Study second = load_study(kStudies / "thesis_4_2.toml", {}).study;
  EXPECT_THAT(
      names_of(first),
      ElementsAre("single.layer_1", "single.flat", "single.tree", "single_offset.layer_1",
                  "single_offset.flat", "single_offset.tree", "multi.layer_1", "multi.flat",
                  "multi.tree", "multi_offset.layer_1", "multi_offset.flat", "multi_offset.tree"));
  EXPECT_THAT(names_of(second), ElementsAre("single.layer_1", "single.flat", "single.tree",
                                            "multi.layer_1", "multi.flat", "multi.tree"));
  for (const Study* study : {&first, &second}) {
    EXPECT_EQ(study->repetitions, 30);
    const double duration_s = study == &first ? 2 : 4;
    for (const Condition& condition : study->conditions) {
      SCOPED_TRACE(condition.name);
      const bool is_flat = condition.name.find("flat") != std::string::npos;
      const bool is_layer_1 = condition.name.find("layer_1") != std::string::npos;
      EXPECT_EQ(tree_policy(*condition.start).layout(),
                study == &first ? ThetaLayout::kMeans : ThetaLayout::kMeansCholesky);
      EXPECT_EQ(condition.start->num_layers(), is_flat ? 1 : 2);
      for (int k = 0; k < 4; ++k) {
        const Component component = tree_policy(*condition.start).tree().finest()[k];
        EXPECT_NEAR(component.mean[0], (k + .5) * duration_s / 4, 1e-14);
        EXPECT_NEAR(component.covariance(0, 0), duration_s * duration_s / 64, 1e-14);
      }
      if (!is_flat) {
        EXPECT_NEAR(tree_policy(*condition.start).tree().layer(1)[0].covariance(0, 0),
                    duration_s * duration_s / 32, 1e-14);
      }
      const explore::ExplorationSettings& e = condition.exploration;
      EXPECT_EQ(e.num_rollouts, 400);
      EXPECT_EQ(e.rule,
                (explore::PowerSettings{
                    .first_update = 5, .best_considered = 5, .minimum_noise = {.fraction = .01}}));
      EXPECT_EQ(e.convergence_window, 20);
      EXPECT_EQ(e.convergence_slope, 0);
      EXPECT_EQ(e.noise_variance,
                study == &first ? (std::vector<double>{.05, 1}) : (std::vector<double>{.1, 1, .1}));
      EXPECT_EQ(e.initial_noise_factor, .1);
      EXPECT_EQ(e.first_layer, 1);
      EXPECT_EQ(e.last_layer, is_flat || is_layer_1 ? 1 : 2);
    }
  }
}

// Tables 4-1 and 4-2: six values of each noise, the other one as it was found best or kept.
TEST(ShippedStudiesTest, TheNoiseStudiesHaveTheGridsOfTables41And42) {
  for (const std::string experiment : {"thesis_4_1", "thesis_4_2"}) {
    const Study base = load_study(kStudies / (experiment + ".toml"), {}).study;
    const Study minimum = load_study(kStudies / (experiment + "_minimum_noise.toml"), {}).study;
    const Study initial = load_study(kStudies / (experiment + "_initial_noise.toml"), {}).study;
    const double fractions[] = {1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2};
    const double factors[] = {.1, .2, .5, 1, 2, 5};
    ASSERT_EQ(minimum.conditions.size(), 6 * base.conditions.size());
    ASSERT_EQ(initial.conditions.size(), 6 * base.conditions.size());
    for (std::size_t i = 0; i < minimum.conditions.size(); ++i) {
      explore::ExplorationSettings expected = base.conditions[i / 6].exploration;
      expected.initial_noise_factor = 1;
      explore::PowerSettings power{.first_update = 5, .best_considered = 5};
      power.minimum_noise.fraction = fractions[i % 6];
      expected.rule = power;
      EXPECT_EQ(minimum.conditions[i].exploration, expected) << minimum.conditions[i].name;
      EXPECT_TRUE(minimum.conditions[i].name.starts_with(base.conditions[i / 6].name));
      expected.initial_noise_factor = factors[i % 6];
      power.minimum_noise.fraction = 1e-2;
      expected.rule = power;
      EXPECT_EQ(initial.conditions[i].exploration, expected) << initial.conditions[i].name;
    }
  }
}

TEST(ShippedStudiesTest, TheReuseStudyDiffersInReuseAlone) {
  const Study study = load_study(kStudies / "thesis_4_1_reuse.toml", {}).study;
  ASSERT_EQ(study.conditions.size(), 4u * 6 * 2);
  for (std::size_t i = 0; i < study.conditions.size(); i += 2) {
    explore::ExplorationSettings with = study.conditions[i].exploration;
    EXPECT_TRUE(with.reuse);
    with.reuse = false;
    EXPECT_EQ(with, study.conditions[i + 1].exploration);
  }
}

TEST(ShippedStudiesTest, TheSpiralComparesTwoLayoutsOfOneStart) {
  const Study study = load_study(kStudies / "spiral.toml", {}).study;
  EXPECT_THAT(names_of(study), ElementsAre("cholesky", "pourahmadi"));
  EXPECT_EQ(tree_policy(*study.conditions[0].start).layout(), ThetaLayout::kMeansCholesky);
  EXPECT_EQ(tree_policy(*study.conditions[1].start).layout(), ThetaLayout::kMeansPourahmadi);
  const Gmm start = tree_policy(*study.conditions[0].start).tree().finest();
  ASSERT_EQ(start.num_components(), 6);
  for (int k = 0; k < 6; ++k) {
    EXPECT_EQ(start[k].mean, Eigen::Vector3d(k * M_PI, 0, 0));
    EXPECT_EQ(start[k].covariance, Eigen::Vector3d(.5, .05, .05).asDiagonal().toDenseMatrix());
    EXPECT_NEAR(start[k].prior, 1. / 6, 1e-15);
  }
  // Table A-1.
  for (const auto& condition : study.conditions) {
    EXPECT_EQ(condition.exploration.num_rollouts, 1000);
    EXPECT_EQ(condition.exploration.rule,
              (explore::PowerSettings{
                  .first_update = 20, .best_considered = 10, .minimum_noise = {.fraction = 1e-3}}));
    EXPECT_EQ(condition.exploration.noise_variance, (std::vector<double>{.15, .5, .5, .1, .1}));
  }
}

TEST(ShippedStudiesTest, TheQuickstartHasSeveralTreeRuns) {
  const Study study = load_study(kStudies / "swing_up.toml", {}).study;
  EXPECT_GE(study.num_runs(), 3);
  for (const Condition& condition : study.conditions) {
    EXPECT_GE(condition.start->num_layers(), 2) << condition.name;
    EXPECT_LT(condition.exploration.first_layer, condition.exploration.last_layer);
  }
}

TEST(ShippedStudiesTest, EveryStudyLoadsAndItsResolvedFormIsEqual) {
  int num_studies = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kStudies)) {
    if (entry.path().extension() != ".toml") continue;
    ++num_studies;
    SCOPED_TRACE(entry.path());
    const LoadedStudy first = load_study(entry.path(), {});
    EXPECT_EQ(first.study.name, entry.path().stem());
    study_test::expect_equal(
        first.study,
        load_study(study_test::StudyText(first.resolved.to_toml("")).path(), {}).study);
  }
  EXPECT_GE(num_studies, 5);
}

}  // namespace
}  // namespace treeroll
