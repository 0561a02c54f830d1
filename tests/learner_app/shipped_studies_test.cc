#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "learner/app/study_file.h"
#include "tests/learner_app/equal_studies.h"
#include "tests/learner_app/study_text.h"

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
  EXPECT_THAT(names_of(study), ElementsAre("flat", "layer_1", "layer_2", "tree"));
  EXPECT_EQ(study.repetitions, 30);
  const int num_layers[] = {1, 2, 2, 2};
  const int first_layer[] = {1, 1, 2, 1};
  const int last_layer[] = {1, 1, 2, 2};
  for (int i = 0; i < 4; ++i) {
    const Condition& condition = study.conditions[i];
    EXPECT_EQ(condition.start.num_layers(), num_layers[i]) << condition.name;
    EXPECT_EQ(condition.start.finest().num_components(), 4) << condition.name;
    EXPECT_EQ(condition.layout, ThetaLayout::kMeansCholesky);
    ExplorationSettings table_4_3;
    table_4_3.num_rollouts = 200;
    table_4_3.first_update = 10;
    table_4_3.best_considered = 2;
    table_4_3.convergence_window = 20;
    table_4_3.convergence_slope = 0;
    table_4_3.noise_variance = {.01, .3, .02};
    table_4_3.initial_noise_factor = 1;
    table_4_3.minimum_noise_fraction = 5e-3;
    table_4_3.first_layer = first_layer[i];
    table_4_3.last_layer = last_layer[i];
    EXPECT_EQ(condition.exploration, table_4_3) << condition.name;
  }
}

TEST(ShippedStudiesTest, TheQuickstartHasSeveralTreeRuns) {
  const Study study = load_study(kStudies / "swing_up.toml", {}).study;
  EXPECT_GE(study.num_runs(), 3);
  for (const Condition& condition : study.conditions) {
    EXPECT_GE(condition.start.num_layers(), 2) << condition.name;
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
        first.study, load_study(study_test::StudyText(first.resolved_toml).path(), {}).study);
  }
  EXPECT_GE(num_studies, 2);
}

}  // namespace
}  // namespace treeroll
