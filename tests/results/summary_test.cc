#include "learner/results/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/results/records.h"

namespace treeroll {
namespace {

using nlohmann::json;
using report_test::run_with;

/// Condition "flat" twice and "tree" four times, given out of order.
std::vector<RunRecord> six_runs() {
  std::vector<RunRecord> runs;
  runs.push_back(run_with("tree", 3, 5, {.2, 1}));
  runs.push_back(run_with("tree", 0, 2, {.1, .85}));
  runs.push_back(run_with("tree", 1, 3, {.9, .3}));
  runs.push_back(run_with("tree", 2, 4, {.3, .95, .1}));
  runs.push_back(run_with("flat", 0, 0, {.5}));
  runs.push_back(run_with("flat", 1, 1, {.6, .7}));
  runs[0].switches = {30, 60};
  runs[1].switches = {40};
  runs[2].switches = {20};
  runs[0].final_reward = .25;
  runs[1].final_reward = .75;
  runs[3].rollouts[2].status = RolloutStatus::kCrashed;
  return runs;
}

TEST(SummaryTest, FiguresOfAConditionAreTakenOverItsRuns) {
  const auto conditions = summarize(six_runs());
  ASSERT_EQ(conditions.size(), 2U);
  const ConditionSummary& tree = conditions[1];
  EXPECT_EQ(tree.condition, "tree");
  EXPECT_EQ(tree.num_runs, 4);
  // Best rewards .85 .9 .95 1: mean and median .925, s = sqrt(.0125 / 3), t = 3.182446.
  EXPECT_DOUBLE_EQ(tree.mean_best_reward.value(), .925);
  EXPECT_DOUBLE_EQ(tree.median_best_reward.value(), .925);
  EXPECT_EQ(tree.best_reward, 1);
  EXPECT_NEAR(tree.interval_95.value().low, .925 - .1027131, 1e-6);
  EXPECT_NEAR(tree.interval_95.value().high, .925 + .1027131, 1e-6);
  EXPECT_EQ(tree.mean_final_reward, .5);
  EXPECT_EQ(tree.num_rollouts, 9);
  EXPECT_EQ(tree.num_failed, 1);
  EXPECT_EQ(tree.num_switches, 4);
  EXPECT_EQ(tree.num_runs_switched, 3);
  EXPECT_EQ(tree.median_first_switch, 31);  // after roll-out 30, counted from 0
}

TEST(SummaryTest, ConditionsStandInTheStudysOrder) {
  const auto conditions = summarize(six_runs());
  EXPECT_EQ(conditions[0].condition, "flat");
  EXPECT_EQ(conditions[0].num_rollouts, 3);
  EXPECT_EQ(conditions[0].median_first_switch, std::nullopt);
  EXPECT_EQ(conditions[0].mean_final_reward, std::nullopt);
}

TEST(SummaryTest, RunsWithoutAResultDoNotCountAsZero) {
  const auto conditions = summarize({run_with("a", 0, 0, {.5}), run_with("a", 1, 1, {})});
  EXPECT_EQ(conditions[0].num_runs, 2);
  EXPECT_EQ(conditions[0].mean_best_reward, .5);
  EXPECT_EQ(conditions[0].interval_95, std::nullopt);
}

TEST(SummaryTest, TheTableIsAlignedAndShowsAbsentFiguresAsDashes) {
  // clang-format off
  EXPECT_EQ(to_table(summarize(six_runs())), R"(
condition  runs  start  mean best    95 % interval  median   best  final    95 % interval  roll-outs  failed  switches  first switch
flat          2      -      0.600  [-0.671, 1.871]   0.600  0.700      -                -          3       0  0 in 0/2             -
tree          4      -      0.925   [0.822, 1.028]   0.925  1.000  0.500  [-2.677, 3.677]          9       1  4 in 3/4          31.0
tree: 1 of 9 roll-outs failed: 1 crashed; the last: repetition 2, roll-out 2: crashed
)"+ 1);
  // clang-format on
}

TEST(SummaryTest, AStudyWithoutResultsHasATableOfDashes) {
  const std::string table = to_table(summarize({run_with("a", 0, 0, {})}));
  EXPECT_THAT(table, testing::Not(testing::HasSubstr("nan")));
  EXPECT_THAT(table, testing::HasSubstr("a             1      -          -"));
}

TEST(SummaryTest, JsonHoldsEveryFigureAndNullForAbsentOnes) {
  StudySummary summary{
      .study = "swing_up",
      .conditions = summarize(six_runs()),
      .ledger = {.issued = 12, .applied = 12, .reissued = 3},
      .workers = {{.host = "a", .pid = 7, .num_evaluators = 2, .num_accepted = 12}},
      .elapsed_s = 1.5};
  const json whole = json::parse(to_json(summary));
  EXPECT_EQ(whole.at("study"), "swing_up");
  EXPECT_EQ(whole.at("seconds"), 1.5);
  const json& flat = whole.at("conditions").at(0);
  EXPECT_EQ(flat.at("condition"), "flat");
  EXPECT_EQ(flat.at("best_reward"), .7);
  EXPECT_EQ(flat.at("rollouts"), 3);
  EXPECT_TRUE(flat.at("median_first_switch").is_null());
  EXPECT_EQ(flat.at("interval_95").size(), 2U);
  EXPECT_EQ(whole.at("conditions").at(1).at("switches"), 4);
  EXPECT_EQ(whole.at("ledger"), (json{{"issued", 12},
                                      {"applied", 12},
                                      {"pending", 0},
                                      {"late", 0},
                                      {"duplicate", 0},
                                      {"failed", 0},
                                      {"discarded", 0},
                                      {"rejected", 0},
                                      {"reissued", 3},
                                      {"conflicting", 0},
                                      {"unasked", 0}}));
  EXPECT_EQ(whole.at("workers").at(0).at("accepted"), 12);
}

TEST(SummaryTest, AHostNameThatIsNotUtf8DoesNotSpoilTheJson) {
  StudySummary summary;
  summary.workers.emplace_back().host = "\xff\xfe";
  EXPECT_EQ(json::parse(to_json(summary)).at("workers").at(0).at("host"),
            "\xef\xbf\xbd\xef\xbf\xbd");
}

}  // namespace
}  // namespace treeroll
