#include "learner/report/figures/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "learner/report/figures/condition_grid.h"
#include "learner/report/figures/data_sets.h"

namespace treeroll::report {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(PlotTest, ALiteralCannotBeEndedByWhatItHolds) {
  EXPECT_EQ(literal("multi.tree"), "'multi.tree'");
  EXPECT_EQ(literal("it's"), "'it''s'");
  EXPECT_EQ(literal("a'; system('rm x'); '"), "'a''; system(''rm x''); '''");
  EXPECT_EQ(literal("a\nquit\r\t\x7f"), "'a quit   '");
  EXPECT_EQ(literal("}{\\"), "')( '");
}

TEST(PlotTest, WhatIsNotFiniteLeavesAGap) {
  EXPECT_EQ(datum(.1), "0.1");
  EXPECT_EQ(datum(std::numeric_limits<double>::quiet_NaN()), "NaN");
  EXPECT_EQ(datum(std::numeric_limits<double>::infinity()), "NaN");
}

TEST(PlotTest, AScriptDrawsEveryFormatFromTheFileBesideIt) {
  Plot plot{.id = "curves", .commands = "  plot data\n"};
  const std::string script = script_of(plot);
  EXPECT_THAT(script, HasSubstr("data = 'curves.dat'\n"));
  EXPECT_THAT(script, HasSubstr("set output 'curves.'.format\n"));
  EXPECT_THAT(script, HasSubstr("set terminal svg noenhanced"));
  // 900 x 500 picture points of 1/96 inch, at 300 dots an inch.
  EXPECT_THAT(script, HasSubstr("set terminal pngcairo noenhanced size 2812,1562 "));
  EXPECT_THAT(script, HasSubstr("set terminal pdfcairo noenhanced size 9.3750,5.2083 "));
}

TEST(PlotTest, OnePanelFillsThePlotAndManyShareAKey) {
  Plot plot;
  arrange({.rows = {{"  plot data\n"}}}, plot);
  EXPECT_THAT(plot.commands, Not(HasSubstr("NaN")));
  arrange({.rows = {std::vector<std::string>(5, "  plot data\n")}, .labels = {"a", "b"}}, plot);
  EXPECT_THAT(plot.commands,
              HasSubstr("NaN with lines lt 1 title 'a', NaN with lines lt 2 title 'b'"));
  EXPECT_EQ(plot.height_px, 2 * 300 + 40);  // three beside each other
}

TEST(PlotTest, LinesWithoutALabelAreNotInTheKey) {
  Plot plot;
  arrange({.rows = {{"  plot data\n"}}, .labels = {"a", "", "c"}}, plot);
  EXPECT_THAT(plot.commands,
              HasSubstr("NaN with lines lt 1 title 'a', NaN with lines lt 3 title 'c'"));
}

TEST(PlotTest, PagesHoldAllInOrderAndTheFirstHasTheIdItself) {
  const auto pages = pages_of(std::vector<int>{1, 2, 3, 4, 5}, 2);
  EXPECT_THAT(pages, ElementsAre(ElementsAre(1, 2), ElementsAre(3, 4), ElementsAre(5)));
  Plot plot{.title = "Policies"};
  name_page("policies", 0, 1, plot);
  EXPECT_EQ(plot.id, "policies");
  EXPECT_EQ(plot.title, "Policies");
  name_page("policies", 1, 3, plot);
  EXPECT_EQ(plot.id, "policies_page_2");
  EXPECT_EQ(plot.title, "Policies, page 2 of 3");
}

TEST(PlotTest, APanelOfAnotherRowNeverStandsBesideOne) {
  Plot plot;
  arrange({.rows = {{"  plot 'flat'\n"}, {"  plot 'coarse'\n", "  plot 'fine'\n"}}}, plot);
  const std::string half = "set size 0.500000,0.468750\n";  // two lines of 300 below a key of 40
  EXPECT_THAT(plot.commands, HasSubstr("set origin 0.000000,0.468750; " + half + "  plot 'flat'"));
  EXPECT_THAT(plot.commands,
              HasSubstr("set origin 0.000000,0.000000; " + half + "  plot 'coarse'"));
  EXPECT_THAT(plot.commands, HasSubstr("set origin 0.500000,0.000000; " + half + "  plot 'fine'"));
}

TEST(PlotTest, ALongRowHasLinesOfItsOwn) {
  EXPECT_EQ(num_columns(6, 2), 3U);
  EXPECT_EQ(num_columns(5, 2), 3U);
  EXPECT_EQ(num_columns(8, 2), 4U);
  EXPECT_EQ(num_columns(4, 2), 4U);
  EXPECT_EQ(num_columns(4, 1), 2U);
}

TEST(PlotTest, ARowStaysOnItsPage) {
  const std::vector<int> five = {1, 2, 3, 4, 5};
  const std::vector<int> six = {1, 2, 3, 4, 5, 6};
  EXPECT_THAT(pages_of_rows(Rows<int>{five, six, five}),
              ElementsAre(ElementsAre(five, six), ElementsAre(five)));
  // Two columns have five lines at most.
  const std::vector<int> two = {1, 2};
  EXPECT_THAT(pages_of_rows(Rows<int>(6, two)),
              ElementsAre(ElementsAre(two, two, two, two, two), ElementsAre(two)));
  // Rows of one panel are one row.
  EXPECT_THAT(pages_of_rows(Rows<int>{{1}, {2}, {3}}),
              ElementsAre(ElementsAre(ElementsAre(1, 2, 3))));
  EXPECT_TRUE(pages_of_rows(Rows<int>{}).empty());
}

TEST(PlotTest, MarksStandAtRoundNumbers) {
  EXPECT_EQ(round_step(150), 50);
  EXPECT_EQ(round_step(200), 50);
  EXPECT_EQ(round_step(400), 100);
  EXPECT_EQ(round_step(1000), 200);
  EXPECT_EQ(round_step(7), 2);
  EXPECT_DOUBLE_EQ(round_step(.3), .05);
  for (double span = 1; span < 1e7; span *= 1.07) {
    EXPECT_LE(span / round_step(span), 6.0001) << span;
    EXPECT_GT(span / round_step(span), 2.3) << span;
  }
}

TEST(PlotTest, OneScaleHasOneDistanceOfMarks) {
  Box box;
  box.include(-1, 0);
  box.include(3, 1);
  box.include(std::numeric_limits<double>::quiet_NaN(), 99);
  EXPECT_EQ(equal_axes(box),
            "  set size ratio -1; set xrange [-1.16:3.16]; set yrange [-0.16:1.16]\n"
            "  set xtics 1; set ytics 1\n");
}

TEST(ConditionGridTest, APointBetweenDigitsIsADecimalOne) {
  EXPECT_THAT(parts_of("multi.tree.minimum_noise_fraction=0.05"),
              ElementsAre("multi", "tree", "minimum_noise_fraction=0.05"));
  EXPECT_THAT(parts_of("flat"), ElementsAre("flat"));
  EXPECT_THAT(parts_of(""), ElementsAre(""));
}

TEST(ConditionGridTest, GroupsDifferInOnePartAndKeepTheStudysOrder) {
  const std::vector<std::string> conditions = {"single.flat", "single.tree", "multi.flat",
                                               "multi.tree"};
  const auto by_last = group(conditions, 1);
  ASSERT_EQ(by_last.size(), 2);
  EXPECT_EQ(by_last[1].name, "multi");
  EXPECT_THAT(by_last[1].conditions, ElementsAre("multi.flat", "multi.tree"));
  EXPECT_THAT(by_last[1].labels, ElementsAre("flat", "tree"));
  const auto by_first = group(conditions, 2);
  ASSERT_EQ(by_first.size(), 2);
  EXPECT_EQ(by_first[0].name, "flat");
  EXPECT_THAT(by_first[0].labels, ElementsAre("single", "multi"));
}

TEST(ConditionGridTest, RowsShareAllButTheLastPart) {
  const std::vector<std::string> conditions = {"single.flat.1", "single.flat.2", "single.tree.1",
                                               "multi.flat.1"};
  const auto rows = rows_by(group(conditions, 1), [](const ConditionGroup& g) { return g.row; });
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0][1].name, "single, tree");
  EXPECT_EQ(rows[1][0].name, "multi, flat");
  EXPECT_EQ(shared_parts("single.flat.1"), "single, flat");
  EXPECT_EQ(shared_parts("flat"), "");
}

TEST(ConditionGridTest, PairsDifferInOnePartAlone) {
  using testing::Pair;
  EXPECT_THAT(
      pairs_of({"a.1", "a.2", "b.1", "b.2"}),
      ElementsAre(Pair("a.1", "a.2"), Pair("b.1", "b.2"), Pair("a.1", "b.1"), Pair("a.2", "b.2")));
  EXPECT_THAT(pairs_of({"x", "y", "z"}),
              ElementsAre(Pair("x", "y"), Pair("x", "z"), Pair("y", "z")));
}

TEST(ConditionGridTest, ConditionsWithoutPartsAreOneGroup) {
  const auto groups = group({"flat", "tree"}, 1);
  ASSERT_EQ(groups.size(), 1);
  EXPECT_EQ(groups[0].name, "");
  EXPECT_THAT(groups[0].labels, ElementsAre("flat", "tree"));
}

}  // namespace
}  // namespace treeroll::report
