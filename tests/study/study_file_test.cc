#include "learner/study/study_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "common/policy/policy.h"
#include "tests/fit/start_tree.h"
#include "tests/study/equal_studies.h"
#include "tests/study/small_study.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

using study_test::kSmallStudy;
using study_test::StudyText;
using testing::HasSubstr;

LoadedStudy load(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return load_study(StudyText(text).path(), overrides);
}

TEST(StudyFileTest, AStudyIsReadWithItsDefaults) {
  const Study study = load(kSmallStudy).study;
  EXPECT_EQ(study.name, "small");
  EXPECT_EQ(study.seed, 1U);
  EXPECT_EQ(study.repetitions, 1);
  EXPECT_TRUE(study.in_sequence);
  ASSERT_EQ(study.conditions.size(), 1U);
  const Condition& condition = study.conditions[0];
  EXPECT_EQ(condition.name, "tree");
  EXPECT_EQ(condition.task_content,
            R"({"name":"swing_up","settings":{"plant":"rk4","step_s":0.005}})");
  EXPECT_EQ(condition.start->num_layers(), 2);
  EXPECT_EQ(condition.exploration.num_rollouts, 30);
  EXPECT_EQ(condition.exploration.in_flight, 1);
  EXPECT_EQ(condition.exploration.noise_variance, (std::vector<double>{.01, .3, .02}));
}

TEST(StudyFileTest, AStudyMayBeLearntForATimeAndItsResolvedFormSaysSo) {
  EXPECT_EQ(load(kSmallStudy).study.stop_after, std::nullopt);
  EXPECT_EQ(load(kSmallStudy).study.final_evaluations, 1);
  EXPECT_EQ(load(kSmallStudy).study.discards_max, 10);
  const LoadedStudy valued =
      load(kSmallStudy, {"study.final_evaluations=20", "study.discards_max=0"});
  EXPECT_EQ(load(valued.resolved.to_toml("")).study.final_evaluations, 20);
  EXPECT_EQ(load(valued.resolved.to_toml("")).study.discards_max, 0);
  const LoadedStudy timed = load(kSmallStudy, {"study.stop_after_s=1.5"});
  EXPECT_EQ(timed.study.stop_after, std::chrono::milliseconds(1500));
  EXPECT_EQ(load(timed.resolved.to_toml("")).study.stop_after, std::chrono::milliseconds(1500));
}

TEST(StudyFileTest, FilesOfADemonstrationStandBesideTheStudy) {
  const StudyText file(
      kSmallStudy +
      R"(policy.demonstration = {kind = "csv", files = ["demo.csv"], inputs = ["t"], outputs = ["u"]}
)");
  {
    std::ofstream demonstration(file.folder() / "demo.csv");
    demonstration << "t,u\n";
    for (int i = 0; i < 50; ++i) demonstration << .05 * i << ',' << (i * i) % 11 << '\n';
  }
  const LoadedStudy loaded = load_study(file.path(), {});
  EXPECT_NEAR(tree_policy(*loaded.study.conditions[0].start).tree().finest()[3].mean[0], 2.1, .4);
  // Resolved, the study can stand anywhere.
  const LoadedStudy again = load_study(StudyText(loaded.resolved.to_toml("")).path(), {});
  study_test::expect_equal(again.study, loaded.study);
  // Named without a folder, it stands in the current one.
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(file.folder());
  EXPECT_NO_THROW(
      study_test::expect_equal(load_study(file.path().filename(), {}).study, loaded.study));
  std::filesystem::current_path(before);
  std::filesystem::remove(file.folder() / "demo.csv");
  EXPECT_THAT(study_test::error_of(file, [](const auto& path) { load_study(path, {}); }),
              HasSubstr("demo.csv: is no file"));
}

TEST(StudyFileTest, ConditionsDifferInPolicyTaskExplorationAndBudget) {
  const Study study = load(kSmallStudy + R"([[conditions]]
name = "flat"
study.rollouts = 7
study.in_flight = 3
task.step_s = 0.01
policy = {model = "flat", components = [3], layout = "means"}
exploration.noise_variance = [1, 2]
exploration.first_update = 4
)")
                          .study;
  ASSERT_EQ(study.conditions.size(), 2U);
  const Condition& flat = study.conditions[1];
  EXPECT_EQ(flat.start->num_layers(), 1);
  EXPECT_EQ(tree_policy(*flat.start).tree().finest().num_components(), 3);
  EXPECT_EQ(tree_policy(*flat.start).layout(), ThetaLayout::kMeans);
  EXPECT_EQ(flat.exploration.num_rollouts, 7);
  EXPECT_EQ(flat.exploration.in_flight, 3);
  EXPECT_EQ(flat.exploration.rule, explore::PowerSettings{.first_update = 4});
  EXPECT_THAT(flat.task_content, HasSubstr("\"step_s\":0.01"));
  EXPECT_EQ(study.conditions[0].exploration.num_rollouts, 30);
  EXPECT_EQ(study.conditions[0].start->num_layers(), 2);
}

TEST(StudyFileTest, EqualTasksHaveEqualTextWhateverTheOrderOfTheirKeys) {
  const Study a = load(kSmallStudy).study;
  const Study b =
      load(study_test::with("plant = \"rk4\"\nstep_s = 0.005", "step_s = 5e-3\nplant = \"rk4\""))
          .study;
  EXPECT_EQ(a.conditions[0].task_content, b.conditions[0].task_content);
}

TEST(StudyFileTest, OverridesChangeEveryCondition) {
  const Study study =
      load(kSmallStudy + "[[conditions]]\nname = \"b\"\nstudy.rollouts = 9\n",
           {"study.rollouts=5", "study.order=arrival", "study.seed=12", "task.plant=ode"})
          .study;
  EXPECT_EQ(study.seed, 12U);
  EXPECT_FALSE(study.in_sequence);
  for (const Condition& condition : study.conditions) {
    EXPECT_EQ(condition.exploration.num_rollouts, 5) << condition.name;
    EXPECT_THAT(condition.task_content, HasSubstr("\"plant\":\"ode\"")) << condition.name;
  }
}

TEST(StudyFileTest, TheResolvedStudyLoadsToAnEqualOne) {
  const LoadedStudy first = load(study_test::with("rollouts = 30", "rollouts = 30\nseed = 77") +
                                     R"(policy.demonstration.p = [-0.1086310, -0.1879148, 0.1, 0.1]
exploration.convergence_slope = 0.1
[[conditions]]
name = "flat"
study.in_flight = 4
task.parameters = {m1 = 0.3333333333333333, "odd key" = [1, 2.0, {a = "b"}]}
policy.model = "flat"
policy.components = [4]
[[axes]]
key = "exploration.initial_noise_factor"
values = [0.1, 1e-5, 3]
)",
                                 {"study.repetitions=3"});
  const LoadedStudy second = load(first.resolved.to_toml(""));
  study_test::expect_equal(first.study, second.study);
  EXPECT_EQ(second.resolved.to_toml(""), first.resolved.to_toml(""));
  EXPECT_EQ(first.study.num_runs(), 18);
}

TEST(StudyFileTest, TheResolvedStudyHoldsWhatADefaultWas) {
  const std::string resolved = load(kSmallStudy).resolved.to_toml("");
  EXPECT_THAT(resolved, HasSubstr("order = \"sequence\""));
  EXPECT_THAT(resolved, HasSubstr("layout = \"means_cholesky\""));
  EXPECT_THAT(resolved, HasSubstr("initial_noise_factor = 1.0"));
  EXPECT_THAT(resolved, HasSubstr("[conditions.study]\nin_flight = 1\nrollouts = 30\n"));
}

TEST(StudyFileTest, AResolvedStudyCanStillBeOverridden) {
  const LoadedStudy resolved = load(load(kSmallStudy).resolved.to_toml(""), {"study.rollouts=3"});
  EXPECT_EQ(resolved.study.conditions[0].exploration.num_rollouts, 3);
}

TEST(StudyFileTest, ATaskOfThePolicysDimensionsIsAccepted) {
  EXPECT_NO_THROW(check_task(load(kSmallStudy), 0, {.input_dim = 1, .output_dim = 1}));
}

TEST(StudyFileTest, ATaskOfOtherDimensionsIsRefusedWithTheNumbers) {
  const StudyText file(kSmallStudy);
  const LoadedStudy loaded = load_study(file.path(), {});
  const std::string error = study_test::error_of(
      file, [&](const auto&) { check_task(loaded, 0, {.input_dim = 6, .output_dim = 1}); });
  EXPECT_EQ(error,
            "FILE:8: policy: has 1 inputs and 1 outputs, must have 6 inputs and 1 outputs for this "
            "task (condition tree)");
}

TEST(StudyFileTest, WhatAWorkerSaysOfATaskIsShownWithTheLineItStandsOn) {
  const StudyText file(kSmallStudy);
  const LoadedStudy loaded = load_study(file.path(), {"task.plant=x"});
  const auto said = [&](const ConfigError& error) {
    return file.shortened(condition_error(loaded, 0, error).what());
  };
  EXPECT_EQ(said(ConfigError("task.step_s", "0.005", "must be 1")),
            "FILE:7: task.step_s = 0.005: must be 1 (condition tree)");
  EXPECT_EQ(said(ConfigError("task.plant", "\"x\"", "must be ode")),
            "--set: task.plant = \"x\": must be ode (condition tree)");
  EXPECT_EQ(said(ConfigError("task.duration_s", "", "is required and missing")),
            "FILE:4: task.duration_s: is required and missing (condition tree)");
}

}  // namespace
}  // namespace treeroll
