#include "learner/fit/start_policy.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/policy/policy.h"
#include "common/settings/settings_reader.h"
#include "learner/fit/demonstration.h"
#include "learner/fit/fit_tree.h"
#include "tests/fit/read_start.h"
#include "tests/fit/start_tree.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

TEST(StartPolicyTest, GivesTheTreeOfTheSwingUpByDefault) {
  const StartPolicy policy = read_start_tree("{}");
  EXPECT_EQ(tree_policy(policy).layout(), ThetaLayout::kMeansCholesky);
  EXPECT_EQ(tree_of(policy).frame_kind(), FrameKind::kEigenvector);
  FitSettings settings;
  settings.em.regularisation = Eigen::Vector2d(1e-3, 1);
  settings.refine.emplace();
  const TreeModel expected = fit_bottom_up(demonstrate({}), 2, 2, settings);
  EXPECT_EQ(to_json(*policy.policy),
            to_json(TreePolicy(expected, 1, tree_policy(policy).layout())));
}

TEST(StartPolicyTest, TellsHowWellEachLayerDescribesTheDemonstration) {
  const StartPolicy policy = read_start_tree(R"({"fit": {"refine": "none"}})");
  ASSERT_EQ(policy.log_likelihoods.size(), 2);
  const Eigen::MatrixXd data = demonstrate({});
  EXPECT_EQ(policy.log_likelihoods[0], mean_log_likelihood(tree_of(policy).layer(1), data));
  EXPECT_EQ(policy.log_likelihoods[1], mean_log_likelihood(tree_of(policy).layer(2), data));
  EXPECT_GT(policy.log_likelihoods[1], policy.log_likelihoods[0]);  // four Gaussians, not two
}

TEST(StartPolicyTest, KeepsTheDemonstrationItWasFittedTo) {
  ASSERT_NE(read_start_tree("{}").demonstration, nullptr);
  EXPECT_EQ(*read_start_tree("{}").demonstration, demonstrate({}));
  const char* given = R"({"start": "components", "model": "flat",
      "layer_1": {"range": [0, 2], "outputs": [0], "deviations": [0.5, 0.3]}})";
  EXPECT_EQ(read_start_tree(given).demonstration, nullptr);
}

TEST(StartPolicyTest, ReadsEveryKey) {
  const StartPolicy policy = read_start_tree(R"({
      "model": "top_down_tree", "components": [1, 2, 4], "layout": "means", "frames": "cholesky",
      "demonstration": {"kind": "cart_acceleration", "duration_s": 2, "samples": 100,
                        "p": [0.1, -0.2, 0.3, 0.05]},
      "fit": {"iterations": 50, "regularisation": [0.002, 0.5], "initial_output_deviation": 4,
              "split_axis": "principal", "refine": "regression", "stop_relative_error": 0.05}})");
  FitSettings settings;
  settings.frame_kind = FrameKind::kCholesky;
  settings.em = {50, Eigen::Vector2d(.002, .5)};
  settings.initial_output_deviation = 4;
  settings.refine = RegressionSettings{.stop_relative_error = .05};
  const Eigen::MatrixXd data = demonstrate({2, 100, {.1, -.2, .3, .05}});
  const TreeModel expected = fit_top_down(data, 4, 3, settings);
  EXPECT_EQ(tree_policy(policy).layout(), ThetaLayout::kMeans);
  EXPECT_EQ(to_json(*policy.policy),
            to_json(TreePolicy(expected, 1, tree_policy(policy).layout())));

  settings = {};
  settings.em.regularisation = Eigen::Vector2d(1e-3, 1);
  settings.split.axis = SplitAxis::kPrincipal;
  const TreeModel principal = fit_bottom_up(demonstrate({}), 2, 2, settings);
  EXPECT_EQ(
      to_json(*read_start_tree(R"({"fit": {"split_axis": "principal", "refine": "none"}})").policy),
      to_json(TreePolicy(principal, 1, ThetaLayout::kMeansCholesky)));
}

TEST(StartPolicyTest, UsesTheLastLayersNumberForAFlatModel) {
  const StartPolicy policy = read_start_tree(R"({"model": "flat", "components": [2, 5]})");
  EXPECT_EQ(tree_of(policy).num_layers(), 1);
  EXPECT_EQ(tree_of(policy).num_components(1), 5);
}

TEST(StartPolicyTest, CountsComponentsItselfWhereAsked) {
  json resolved;
  EXPECT_EQ(tree_of(read_start_tree(R"({"model": "flat", "components": "auto"})", &resolved))
                .num_components(1),
            3);
  EXPECT_EQ(resolved["components"], "auto");
  const StartPolicy tree = read_start_tree(R"({"model": "top_down_tree", "components": "auto"})");
  EXPECT_EQ(tree_of(tree).num_components(1), 2);
  EXPECT_EQ(tree_of(tree).num_components(2), 4);
  // What counts is the tree that is learnt, not a flat model of as many components.
  const StartPolicy bottom_up = read_start_tree(R"({"model": "tree", "components": "auto"})");
  EXPECT_LE(relative_regression_error(tree_of(bottom_up).finest(), demonstrate({})), .1);
}

/// Three joints of a robot at 200 a second: all sizes together would take too long, and the first
/// that is near enough does not.
TEST(StartPolicyTest, CountsTheComponentsOfALongRecording) {
  const char* table =
      R"({"model": "top_down_tree", "components": "auto", "fit": {"iterations": 20}, "demonstration":
      {"kind": "csv", "files": ["a.csv"], "inputs": ["t"], "outputs": ["x", "y", "z"]}})";
  std::string arm = "t,x,y,z\n";
  std::string noise = arm;
  for (int n = 0; n < 1200; ++n) {
    const double t = n / 200.;
    arm += fmt::format("{},{},{},{}\n", t, std::sin(t), std::cos(t), std::sin(t + 1));
    const double jump = n / 10 % 2 == 0 ? 1 : -1;
    noise += fmt::format("{},{},{},{}\n", t, jump, 2 * jump, -jump);
  }
  const auto read = [&](const std::string& text) {
    return [text](const std::string&) { return text; };
  };
  EXPECT_EQ(tree_of(read_start(table, {.read_file = read(arm)})).num_layers(), 2);
  // Where none is, the way out that is named is not refused.
  const std::string refusal = refusal_of(table, {.read_file = read(noise)});
  EXPECT_THAT(refusal, HasSubstr("of up to 14 components none come within 0.1"));
  EXPECT_THAT(refusal, HasSubstr("too long with so many samples: say how many there are to be, at "
                                 "most 24"));
  EXPECT_EQ(refusal_of(R"({"model": "flat", "components": [24], "demonstration": {"kind": "csv",
      "files": ["a.csv"], "inputs": ["t"], "outputs": ["x", "y", "z"]}})",
                       {.read_file = read(arm)}),
            "accepted");
}

/// Defaults of two kinds of demonstration regularise the same data differently, and EM ends in two
/// places: refined, they are worth the same.
TEST(StartPolicyTest, OneDemonstrationGivesOneCurveWhateverItCameFrom) {
  std::string csv = "t,u\n";
  const Eigen::MatrixXd data = demonstrate({});
  for (Eigen::Index n = 0; n < data.cols(); ++n) {
    csv += fmt::format("{},{}\n", data(0, n), data(1, n));
  }
  const json table = json::parse(R"({"model": "flat", "components": [4], "demonstration":
      {"kind": "csv", "files": ["demo.csv"], "inputs": ["t"], "outputs": ["u"]}})");
  json resolved;
  SettingsReader reader(table, "policy", resolved);
  const StartPolicy from_file =
      read_start_policy(reader, {.read_file = [&](const std::string&) { return csv; }});
  const StartPolicy built_in = read_start_tree(R"({"model": "flat", "components": [4]})");
  const Gmm finest[] = {tree_of(from_file).finest(), tree_of(built_in).finest()};
  for (const Gmm& gmm : finest) EXPECT_LE(relative_regression_error(gmm, data), .02);
}

TEST(StartPolicyTest, FitsOfEarlierFormsAreNotRefinedUnlessTheySaySo) {
  const auto start_of_form = [](const char* text, int form) {
    const json table = json::parse(text);
    json resolved;
    SettingsReader reader(table, "policy", resolved);
    return to_json(*read_start_policy(reader, {.form = form}).policy);
  };
  const char* refined = R"({"fit": {"refine": "regression"}})";
  const char* plain = R"({"fit": {"refine": "none"}})";
  EXPECT_EQ(start_of_form("{}", 2), start_of_form(plain, 3));
  EXPECT_EQ(start_of_form("{}", 3), start_of_form(refined, 2));
  EXPECT_NE(start_of_form("{}", 2), start_of_form("{}", 3));
}

TEST(StartPolicyTest, ResolvesToSettingsThatGiveTheSamePolicy) {
  json resolved;
  const StartPolicy policy = read_start_tree("{}", &resolved);
  EXPECT_EQ(resolved["demonstration"]["samples"], 200);
  EXPECT_EQ(resolved["fit"]["iterations"], 500);
  const StartPolicy again = read_start_tree(resolved.dump());
  EXPECT_EQ(to_json(*again.policy->at_layer(2)), to_json(*policy.policy->at_layer(2)));
}

TEST(StartPolicyTest, RefusesWhatCannotBeUsedNamingTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"model": "forest"})", "policy.model"},
      {R"({"components": []})", "policy.components"},
      {R"({"components": [2, 2.5]})", "policy.components"},
      {R"({"components": [2, 5]})", "twice as many"},
      {R"({"components": [4, 2]})", "twice as many"},
      {R"({"components": [0]})", "policy.components"},
      {R"({"components": [128]})", "at most 64"},
      {R"({"components": [1,1,1,1,1,1,1,1,1]})", "from 1 to 8 numbers"},
      {R"({"components": 4})", "policy.components"},
      {R"({"layout": "psi"})", "policy.layout"},
      {R"({"frames": "global"})", "policy.frames"},
      {R"({"colour": 1})", "policy.colour"},
      {R"({"demonstration": 1})", "policy.demonstration"},
      {R"({"demonstration": {"kind": "file"}})", "policy.demonstration.kind"},
      {R"({"demonstration": {"duration_s": 0}})", "policy.demonstration.duration_s"},
      {R"({"demonstration": {"samples": 1}})", "policy.demonstration.samples"},
      {R"({"demonstration": {"samples": 1000000}})", "from 2 to 100000"},
      {R"({"demonstration": {"samples": 3}})", "the demonstration's 3 samples"},
      {R"({"demonstration": {"p": [1, 2, 3]}})", "must hold 4 numbers"},
      {R"({"demonstration": {"speed": 1}})", "policy.demonstration.speed"},
      {R"({"fit": {"iterations": -1}})", "policy.fit.iterations"},
      {R"({"fit": {"regularisation": [0.001]}})", "policy.fit.regularisation"},
      {R"({"fit": {"regularisation": [0.001, -1]}})", "policy.fit.regularisation"},
      {R"({"fit": {"regularisation": [1, 1, 1]}})", "must hold 2 numbers"},
      {R"({"fit": {"initial_output_deviation": 0}})", "policy.fit.initial_output_deviation"},
      {R"({"fit": {"split_axis": "x"}})", "policy.fit.split_axis"},
      {R"({"fit": {"seed": 1}})", "policy.fit.seed"},
      {R"({"fit": {"refine": "yes"}})", "policy.fit.refine"},
      {R"({"fit": {"refine": "none", "stop_relative_error": 0.1}})",
       "policy.fit.stop_relative_error"},
      {R"({"components": "auto", "fit": {"refine": "none"}})", "needs fit.refine"},
      {R"({"components": "auto", "demonstration": {"samples": 10000},
           "fit": {"iterations": 100000}})",
       "components x samples"},
      {R"({"components": "some"})", "must be a list of numbers"},
      {R"({"model": "flat", "components": [64], "demonstration": {"samples": 10000}})",
       "numbers^2 x (outputs x samples + 8/3 numbers) must be at most 200000000; take at most 27 "
       "components"},
      {R"({"fit": {"iterations": 100000}, "demonstration": {"samples": 100000}})",
       "components x samples x iterations"},
      {R"({"model": "flat", "components": [4], "demonstration": {"samples": 4},
           "fit": {"regularisation": [0, 0]}})",
       "no model can be fitted: iteration"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_THAT(refusal_of_start_tree(text), HasSubstr(message)) << text;
  }
}

}  // namespace
}  // namespace treeroll
