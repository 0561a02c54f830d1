#include "learner/report/figures/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "learner/report/figures/condition_grid.h"

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

TEST(PlotTest, AScriptDrawsBothFormatsFromTheFileBesideIt) {
  Plot plot{.id = "curves", .commands = "  plot data\n"};
  const std::string script = script_of(plot);
  EXPECT_THAT(script, HasSubstr("data = 'curves.dat'\n"));
  EXPECT_THAT(script, HasSubstr("set output 'curves.'.format\n"));
  EXPECT_THAT(script, HasSubstr("set terminal svg noenhanced"));
  EXPECT_THAT(script, HasSubstr("set terminal pngcairo noenhanced"));
}

TEST(PlotTest, OnePanelFillsThePlotAndManyShareAKey) {
  Plot plot;
  arrange({.commands = {"  plot data\n"}, .labels = {}}, plot);
  EXPECT_THAT(plot.commands, Not(HasSubstr("NaN")));
  arrange({.commands = std::vector<std::string>(5, "  plot data\n"), .labels = {"a", "b"}}, plot);
  EXPECT_THAT(plot.commands,
              HasSubstr("NaN with lines lt 1 title 'a', NaN with lines lt 2 title 'b'"));
  EXPECT_EQ(plot.height_px, 2 * 300 + 40);  // three beside each other
}

TEST(PlotTest, LinesWithoutALabelAreNotInTheKey) {
  Plot plot;
  arrange({.commands = {"  plot data\n"}, .labels = {"a", "", "c"}}, plot);
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

TEST(ConditionGridTest, ConditionsWithoutPartsAreOneGroup) {
  const auto groups = group({"flat", "tree"}, 1);
  ASSERT_EQ(groups.size(), 1);
  EXPECT_EQ(groups[0].name, "");
  EXPECT_THAT(groups[0].labels, ElementsAre("flat", "tree"));
}

}  // namespace
}  // namespace treeroll::report
