#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/base/config_error.h"
#include "common/policy/tree/tree_policy.h"
#include "common/protocol/limits.h"
#include "learner/study/message_sizes.h"
#include "learner/study/study_file.h"
#include "tests/study/small_study.h"
#include "tests/study/study_text.h"

namespace treeroll {
namespace {

using study_test::kSmallStudy;
using study_test::StudyText;
using study_test::with;
using testing::HasSubstr;
using testing::StartsWith;

std::string refusal_of_study(const std::string& text,
                             const std::vector<std::string>& overrides = {}) {
  const StudyText file(text);
  return study_test::error_of(file, [&](const auto& path) { load_study(path, overrides); });
}

struct BadStudy {
  std::string text;
  std::string error;  ///< the whole line
};

const BadStudy kBadStudies[] = {
    {with("name = \"small\"", "name = \"small\"\nrolouts = 5"),
     "FILE:3: study.rolouts = 5: unknown key; known here: discards_max, final_evaluations, "
     "in_flight, name, numeric_class, order, recheck, repetitions, rollouts, seed, stop_after_s "
     "(condition "
     "tree)"},
    {with("name = \"small\"", "name = 5"),
     "FILE:2: study.name = 5: must be a string (condition tree)"},
    {with("name = \"small\"", ""), "FILE:1: study.name: is required and missing (condition tree)"},
    {with("name = \"small\"", "name = \"a/b\""),
     "FILE:2: study.name = \"a/b\": must be 1 to 64 letters, digits and _ . -, and begin with none "
     "of . and - (condition tree)"},
    {with("name = \"small\"", "name = \"..\""),
     "FILE:2: study.name = \"..\": must be 1 to 64 letters, digits and _ . -, and begin with none "
     "of . and - (condition tree)"},
    {with("rollouts = 30", ""), "FILE:1: study.rollouts: is required and missing (condition tree)"},
    {with("rollouts = 30", "rollouts = 0"),
     "FILE:3: study.rollouts = 0: must be an integer from 1 to 100000000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 30.0"),
     "FILE:3: study.rollouts = 30.0: must be an integer from 1 to 100000000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 9223372036854775807"),
     "FILE:3: study.rollouts = 9223372036854775807: must be an integer from 1 to 100000000 "
     "(condition tree)"},
    {with("rollouts = 30", "rollouts = 30\nseed = -1"),
     "FILE:4: study.seed = -1: must be an integer from 0 to 9223372036854775807 (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\norder = \"random\""),
     "FILE:4: study.order = \"random\": must be one of: sequence, arrival (condition tree)"},
    {with("rollouts = 30", "rollouts = 100000000\nrepetitions = 11"),
     "FILE:3: study.rollouts = 100000000: the roll-outs of all runs must be at most 100000000 "
     "together (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\nin_flight = 100001"),
     "FILE:4: study.in_flight = 100001: must be an integer from 1 to 100000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 90000\nrepetitions = 12\nin_flight = 90000"),
     "FILE:5: study.in_flight = 90000: the roll-outs in flight of all runs must be at most 1000000 "
     "together (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\nfinal_evaluations = 0"),
     "FILE:4: study.final_evaluations = 0: must be an integer from 1 to 1000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\ndiscards_max = -1"),
     "FILE:4: study.discards_max = -1: must be an integer from 0 to 1000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\nstop_after_s = 0"),
     "FILE:4: study.stop_after_s = 0: must be a finite number of at least 0.001 and at most "
     "100000000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\nstop_after_s = \"1 h\""),
     "FILE:4: study.stop_after_s = \"1 h\": must be a finite number of at least 0.001 and at most "
     "100000000 (condition tree)"},
    {with("rollouts = 30", "rollouts = 30\nrepetitions = 60000") + "[[conditions]]\nname = \"b\"\n",
     "FILE:4: study.repetitions = 60000: 2 conditions times 60000 repetitions: must be at most "
     "100000 runs (condition tree)"},
    {with("name = \"swing_up\"", ""),
     "FILE:4: task.name: is required and missing (condition tree)"},
    {with("[0.01, 0.3, 0.02]", "[0.01, 0.3]"),
     "FILE:11: exploration.noise_variance = [0.01,0.3]: must hold 3 numbers (condition tree)"},
    {with("noise_variance = [0.01, 0.3, 0.02]", "first_update = 5"),
     "FILE:11: exploration.first_update = 5: unknown key; known here: convergence_slope, "
     "convergence_window, first_layer, initial_step, last_layer, metric, output_scale, reuse, "
     "rule, "
     "stop_at_reward, stop_on_convergence (condition tree)"},
    {kSmallStudy + "exploration.noise_variance = [1]\n",
     "FILE:14: exploration.noise_variance = [1]: must hold 3 numbers (condition tree)"},
    {kSmallStudy + "[[axes]]\nkey = \"exploration.first_layer\"\nvalues = [1, 3]\n",
     "FILE:16: exploration.first_layer = 3: must be an integer from 1 to 2 (condition "
     "tree.first_layer=3)"},
    {kSmallStudy + "policy = 5\n", "FILE:14: conditions[0].policy: must be a table"},
};

TEST(StudyFileErrorsTest, EachBadStudyIsRefusedWithLineKeyValueAndRule) {
  for (const BadStudy& bad : kBadStudies) {
    EXPECT_EQ(refusal_of_study(bad.text), bad.error) << bad.text;
  }
}

TEST(StudyFileErrorsTest, SettingsOfThePolicyAndTheExplorationAreRefusedWithTheirLine) {
  EXPECT_THAT(refusal_of_study(with("model = \"top_down_tree\"", "modle = \"flat\"")),
              StartsWith("FILE:9: policy.modle = \"flat\": unknown key; known here: "));
  EXPECT_THAT(refusal_of_study(with("model = \"top_down_tree\"", "model = \"round\"")),
              StartsWith("FILE:9: policy.model = \"round\": must be one of: "));
  EXPECT_THAT(refusal_of_study(with("[0.01, 0.3, 0.02]", "[0.01, -0.3, 0.02]")),
              StartsWith("FILE:11: exploration.noise_variance = [0.01,-0.3,0.02]: each number of "
                         "the list must be"));
  EXPECT_THAT(refusal_of_study(kSmallStudy + "policy.demonstration.sample = 5\n"),
              StartsWith("FILE:14: policy.demonstration.sample = 5: unknown key"));
}

TEST(StudyFileErrorsTest, BadOverridesAreShownAsComingFromTheCommandLine) {
  EXPECT_EQ(refusal_of_study(kSmallStudy, {"study.rollouts=-5"}),
            "--set: study.rollouts = -5: must be an integer from 1 to 100000000 (condition tree)");
  EXPECT_THAT(refusal_of_study(kSmallStudy, {"study.rolouts=5"}),
              StartsWith("--set: study.rolouts = 5: unknown key; known here: "));
  EXPECT_EQ(refusal_of_study(kSmallStudy, {"study.rollouts=many"}),
            "--set: study.rollouts = \"many\": must be an integer from 1 to 100000000 "
            "(condition tree)");
  EXPECT_EQ(refusal_of_study(kSmallStudy, {"study={name = \"x\", seed = 1.5}"}),
            "--set: study.seed = 1.5: must be an integer from 0 to 9223372036854775807 "
            "(condition tree)");
}

/// `size` components at equal distances, of one input.
Condition condition_with_components(int size, int num_variables = 2) {
  std::vector<Component> components;
  for (int k = 0; k < size; ++k) {
    components.push_back({.prior = 1,
                          .mean = k * Eigen::VectorXd::Unit(num_variables, 0),
                          .covariance = Eigen::MatrixXd::Identity(num_variables, num_variables)});
  }
  return {.name = "large",
          .task_content = "{}",
          .start = std::make_shared<TreePolicy>(
              TreeModel::from_global(FrameKind::kEigenvector, {Gmm(1, components)}, {{}}), 1,
              num_variables == 2 ? ThetaLayout::kMeansCholesky : ThetaLayout::kMeans),
          .exploration = {}};
}

std::string size_error_of(const Condition& condition) {
  try {
    check_message_sizes(condition);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(StudyFileErrorsTest, ATaskTooLargeForAMessageIsRefusedWithItsSize) {
  Condition condition = condition_with_components(2);
  condition.task_content.assign(1'100'000, 'x');
  EXPECT_EQ(size_error_of(condition),
            "task: is too large to be sent: 1100000 bytes, must be at most 1048576");
}

TEST(StudyFileErrorsTest, APolicyTooLargeForAMessageIsRefusedWithItsSize) {
  EXPECT_EQ(size_error_of(condition_with_components(1000)), "");
  EXPECT_THAT(size_error_of(condition_with_components(200, 20)),
              HasSubstr("policy: is too large to be sent: up to "));
  EXPECT_EQ(size_error_of(condition_with_components(1400)),
            "policy: is too large: theta of layer 1 has 4200 elements, must be at most 4096");
}

TEST(StudyFileErrorsTest, APolicyIsMeasuredWithEveryNumberAtItsLongest) {
  // The text of 200 round Gaussians is short enough; what they are after learning would not be.
  const Condition condition = condition_with_components(200, 20);
  const Policy& policy = *condition.start;
  EXPECT_LT(to_json(policy).size(), protocol::kDefinitionBytesMax);
  EXPECT_THAT(size_error_of(condition), HasSubstr("is too large to be sent"));
}

TEST(StudyFileErrorsTest, AStudyWhoseResolvedFormIsTooLargeIsRefused) {
  const auto error_of_600 = [](const std::string& plant) {
    std::string text = with("plant = \"rk4\"", "plant = " + plant);
    text += "[[axes]]\nkey = \"exploration.first_update\"\nvalues = [10";
    for (int i = 11; i < 610; ++i) text += ", " + std::to_string(i);
    return refusal_of_study(text + "]\n");
  };
  std::string numbers = "[1";
  for (int i = 0; i < 1000; ++i) numbers += ", 1";
  EXPECT_THAT(error_of_600(numbers + "]"),
              HasSubstr("FILE: the study is too large: with all settings of each condition"));
  // Long strings cost a parser little, but not nothing.
  EXPECT_EQ(error_of_600("\"" + std::string(5000, 'x') + "\""), "");
  EXPECT_THAT(error_of_600("\"" + std::string(60'000, 'x') + "\""),
              HasSubstr("FILE: the study is too large: with all settings, demonstrations"));
}

}  // namespace
}  // namespace treeroll
