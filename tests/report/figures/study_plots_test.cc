#include "learner/report/figures/study_plots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/results/records.h"

namespace treeroll::report {
namespace {

using report_test::run_with;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Two conditions, three repetitions of four roll-outs each; "tree" is ahead.
StudyResults two_conditions() {
  StudyResults study{.name = "mine", .directory = "", .runs = {}};
  for (int i = 0; i < 3; ++i) {
    study.runs.push_back(run_with("tree", i, i, {.1 * i, .5 + .1 * i, .9, .9}));
  }
  for (int i = 0; i < 3; ++i) {
    study.runs.push_back(run_with("flat", i, 3 + i, {.1 * i, .01 * i, .2, .3}));
  }
  return study;
}

Plot find(const Figures& figures, const std::string& id) {
  const std::vector<Plot>& plots = figures.plots;
  const auto found =
      std::find_if(plots.begin(), plots.end(), [&](const Plot& plot) { return plot.id == id; });
  return found == plots.end() ? Plot{} : *found;
}

TEST(StudyPlotsTest, CurvesHaveMeanAndInterval) {
  const Plot plot = find(study_plots(two_conditions()), "learning_curves");
  // 0, .1, .2: mean .1, half width t(2, .975) .1 / sqrt 3 = 4.302653 x .0577350 = .248414.
  EXPECT_THAT(plot.data, HasSubstr("# rollout mean low high\n1 0.1"));
  EXPECT_THAT(plot.data, HasSubstr(" -0.14841"));
  EXPECT_THAT(plot.data, HasSubstr(" 0.34841"));
  // Equal values: no width.
  EXPECT_THAT(plot.data, HasSubstr("\n4 0.9 0.9 0.9\n\n\n"));
  EXPECT_THAT(plot.commands, HasSubstr("title 'tree'"));
}

TEST(StudyPlotsTest, ARunAloneHasNoBand) {
  StudyResults study{.name = "one", .directory = "", .runs = {run_with("a", 0, 0, {.5, .6})}};
  const std::vector<Plot> plots = study_plots(study).plots;
  ASSERT_EQ(plots.size(), 1);  // no p-values, no switches
  EXPECT_THAT(plots[0].data, HasSubstr("1 0.5 NaN NaN\n2 0.6 NaN NaN\n"));
}

TEST(StudyPlotsTest, LongRunsAreAveragedOverRollouts) {
  std::vector<double> rewards;
  for (int i = 0; i < 400; ++i) rewards.push_back(i % 2);
  StudyResults study{.name = "long", .directory = "", .runs = {run_with("a", 0, 0, rewards)}};
  const Plot plot = study_plots(study).plots.front();
  EXPECT_EQ(std::count(plot.data.begin(), plot.data.end(), '\n'), 1 + 200 + 2);
  EXPECT_THAT(plot.data, HasSubstr("\n1.5 0.5 NaN NaN\n"));
  EXPECT_THAT(plot.caption, HasSubstr("A point is a mean over 2 roll-outs."));
}

TEST(StudyPlotsTest, EvidencePointsToTheConditionAhead) {
  const Plot plot = find(study_plots(two_conditions()), "p_values");
  EXPECT_THAT(plot.commands, HasSubstr("'tree over flat'"));
  EXPECT_THAT(plot.data, HasSubstr("1 0.5 "));  // equal means
  // .9 against .3 without spread: certain, drawn at the end of the axis.
  EXPECT_THAT(plot.data, HasSubstr("\n4 0 8\n"));
}

TEST(StudyPlotsTest, BoxesCountRolloutsFromOneAndNameThoseThatSwitched) {
  StudyResults study = two_conditions();
  EXPECT_THAT(find(study_plots(study), "switches").id, IsEmpty());
  study.runs[0].switches = {0};
  study.runs[2].switches = {2, 3};
  const Plot plot = find(study_plots(study), "switches");
  // Row, quartiles of 1 and 3, least, most, runs.
  EXPECT_THAT(plot.data, HasSubstr("\n-1 1.5 2 2.5 1 3 2\n"));
  EXPECT_THAT(plot.commands, HasSubstr("'tree (2 of 3)' -1"));
  EXPECT_THAT(plot.commands, Not(HasSubstr("flat")));
}

TEST(StudyPlotsTest, AConditionsNameStaysALiteral) {
  StudyResults study{.name = "mine", .directory = "", .runs = {}};
  const std::string name = "x'\nsystem('touch here')\n{";
  for (int i = 0; i < 2; ++i) study.runs.push_back(run_with(name, i, i, {.1, .2}));
  for (int i = 0; i < 2; ++i) study.runs.push_back(run_with("y", i, 2 + i, {.1, .3}));
  study.runs[0].switches = {1};
  for (const Plot& plot : study_plots(study).plots) {
    EXPECT_THAT(plot.data, Not(HasSubstr("system"))) << plot.id;
    EXPECT_THAT(plot.commands, HasSubstr("x'' system(''touch here'') (")) << plot.id;
  }
}

TEST(StudyPlotsTest, AGridOfConditionsHasAPanelAGroupBothWays) {
  StudyResults study{.name = "grid", .directory = "", .runs = {}};
  int run = 0;
  for (const char* goal : {"single", "multi"}) {
    for (const char* model : {"flat", "tree"}) {
      study.runs.push_back(run_with(std::string(goal) + "." + model, 0, run++, {.1, .2}));
    }
  }
  const Figures plots = study_plots(study);
  EXPECT_THAT(find(plots, "learning_curves").commands, HasSubstr("set title 'multi'"));
  EXPECT_THAT(find(plots, "learning_curves_across").commands, HasSubstr("set title 'tree'"));
}

TEST(StudyPlotsTest, NoRunsGiveNoPlots) {
  EXPECT_THAT(study_plots({.name = "none", .directory = "", .runs = {}}).plots, IsEmpty());
}

TEST(StudyPlotsTest, CurvesAreMarkedWhereTheMedianRunLeavesALayer) {
  StudyResults study = two_conditions();
  EXPECT_THAT(find(study_plots(study), "learning_curves").data, Not(HasSubstr("switches")));
  study.runs[0].switches = {0, 2};
  study.runs[1].switches = {2};
  const Plot plot = find(study_plots(study), "learning_curves");
  // Roll-out 2, the median of 1 and 3, at its mean; then roll-out 3.
  EXPECT_THAT(plot.data, HasSubstr("switches\n2 0.6 "));
  EXPECT_THAT(plot.data, HasSubstr("\n3 0.9 0.9 0.9\n\n\n"));
  EXPECT_THAT(plot.caption, HasSubstr("Circles: the median roll-out"));
}

TEST(StudyPlotsTest, NoiseIsAGeometricMeanOverTheRepetitionsThatAreKnown) {
  const NoiseLevels noise = {{"tree", {{.5, .1}, {.5, .4}}}, {"flat", {{1, 1}, {1, 1}}}};
  const Figures figures = study_plots(two_conditions(), noise);
  const Plot plot = find(figures, "noise_growth");
  EXPECT_THAT(plot.data, HasSubstr("# rollout mean low high\n1 0.5 0.5 0.5\n2 0.2"));
  // Two repetitions far apart: the interval spans decades.
  EXPECT_THAT(plot.commands, HasSubstr("set logscale y; set ytics (0.0001, 0.001, "));
  EXPECT_THAT(plot.caption, HasSubstr("the first 2 repetitions"));
  EXPECT_THAT(find(study_plots(two_conditions()), "noise_growth").id, IsEmpty());
  const NoiseLevels narrow = {{"tree", {{1, .2}, {1, .2}}}};
  EXPECT_THAT(find(study_plots(two_conditions(), narrow), "noise_growth").commands,
              HasSubstr("set logscale y; set ytics (0.2, 0.5, 1)"));
}

TEST(StudyPlotsTest, EveryGroupHasItsPValuesOnOnePageOrAnother) {
  StudyResults study{.name = "many", .directory = "", .runs = {}};
  int run = 0;
  for (int goal = 0; goal < 13; ++goal) {
    for (const char* model : {"flat", "tree"}) {
      for (int i = 0; i < 2; ++i) {
        study.runs.push_back(
            run_with("g" + std::to_string(goal) + "." + model, i, run++, {.1, .2}));
      }
    }
  }
  const Figures figures = study_plots(study);
  EXPECT_THAT(find(figures, "p_values").commands, HasSubstr("set title 'g11'"));
  EXPECT_THAT(find(figures, "p_values_page_2").commands, HasSubstr("set title 'g12'"));
  EXPECT_THAT(figures.left_out, IsEmpty());
}

TEST(StudyPlotsTest, GroupsThatAreNotComparedAreNamed) {
  StudyResults study{.name = "odd", .directory = "", .runs = {}};
  int run = 0;
  for (const char* name : {"a.1", "a.2", "a.3", "a.4", "a.5"}) {
    for (int i = 0; i < 2; ++i) study.runs.push_back(run_with(name, i, run++, {.1}));
  }
  for (const char* name : {"b.1", "b.2"}) study.runs.push_back(run_with(name, 0, run++, {.1}));
  const Figures figures = study_plots(study);
  EXPECT_THAT(figures.left_out,
              testing::ElementsAre(HasSubstr("more than 4 conditions are to be compared pair by "
                                             "pair: a."),
                                   HasSubstr("where a condition has one run: b.")));
}

TEST(StudyPlotsTest, ALongListOfNamesIsCounted) {
  EXPECT_EQ(listed({"a"}), "a");
  EXPECT_EQ(listed({"a", "b", "c", "d", "e", "f", "g"}), "a, b, c, d, e, f, g");
  EXPECT_EQ(listed({"a", "b", "c", "d", "e", "f", "g", "h"}), "a, b, c, d, e, f and 2 more");
}

}  // namespace
}  // namespace treeroll::report
