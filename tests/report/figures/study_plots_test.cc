#include "learner/report/figures/study_plots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "learner/report/statistics/tests_of_means.h"
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
  ASSERT_EQ(plots.size(), 2);  // no p-values, no switches
  EXPECT_EQ(plots[1].id, "average_rewards");
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
  EXPECT_THAT(plot.data, HasSubstr("\n1 0.5 0 1\n"));  // equal means: in the middle
  // .9 against .3 without spread: certain, drawn at the end of the axis, -log10 of 2e-8.
  EXPECT_THAT(plot.data, HasSubstr("\n4 0 7.69897000433"));
  EXPECT_THAT(plot.commands, HasSubstr("set ytics ('.5' 0, '1e-8' 7.69897, '1e-8' -7.69897"));
  EXPECT_THAT(plot.commands, HasSubstr("'.05' 1, '.05' -1)"));
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

/// Of `repetitions` runs each, all alike.
StudyResults grid_of(const std::vector<std::string>& conditions, int repetitions = 2) {
  StudyResults study{.name = "grid", .directory = "", .runs = {}};
  for (const std::string& condition : conditions) {
    for (int i = 0; i < repetitions; ++i) {
      const int run = static_cast<int>(study.runs.size());
      study.runs.push_back(run_with(condition, i, run, {.1, .2}));
    }
  }
  return study;
}

/// How many lines all pages of a figure draw, data set by data set.
std::size_t num_lines(const Figures& figures, const std::string& id) {
  std::size_t count = 0;
  for (const Plot& plot : figures.plots) {
    if (plot.id != id && plot.id.find(id + "_page_") != 0) continue;
    for (std::size_t at = plot.data.find("# "); at != std::string::npos;
         at = plot.data.find("# ", at + 1)) {
      ++count;
    }
  }
  return count;
}

TEST(StudyPlotsTest, EveryGroupHasItsPValuesOnOnePageOrAnother) {
  std::vector<std::string> conditions;
  for (int goal = 0; goal < 13; ++goal) {
    for (const char* model : {".flat", ".tree"}) {
      conditions.push_back("g" + std::to_string(goal) + model);
    }
  }
  const Figures figures = study_plots(grid_of(conditions));
  EXPECT_THAT(find(figures, "p_values").commands, HasSubstr("set title 'g11'"));
  EXPECT_THAT(find(figures, "p_values_page_2").commands, HasSubstr("set title 'g12'"));
  EXPECT_EQ(num_lines(figures, "p_values"), 13U);
  // Thirteen goals of two models, each pair once.
  EXPECT_EQ(num_lines(figures, "p_values_across"), 2U * 13 * 12 / 2);
  EXPECT_THAT(figures.left_out, IsEmpty());
}

TEST(StudyPlotsTest, TableFourThreeSetsEveryModelAgainstEveryOtherNotThePlantsAlone) {
  std::vector<std::string> conditions;
  for (const char* model : {"flat", "layer_1", "layer_2", "tree", "top_down_tree"}) {
    for (const char* plant : {".ode", ".rk4"}) conditions.push_back(std::string(model) + plant);
  }
  const Figures figures = study_plots(grid_of(conditions));
  EXPECT_EQ(num_lines(figures, "p_values"), 5U);
  EXPECT_THAT(find(figures, "p_values").commands, HasSubstr("'ode over rk4'"));
  const Plot models = find(figures, "p_values_across");
  EXPECT_EQ(num_lines(figures, "p_values_across"), 2U * 10);
  EXPECT_THAT(models.commands, HasSubstr("set title 'ode: flat over others'"));
  EXPECT_THAT(models.commands, HasSubstr("set title 'rk4: tree over others'"));
  EXPECT_THAT(models.commands, HasSubstr("set label 1 'flat ahead'"));
  // A line is the same model in every panel: the fourth is the top-down tree.
  EXPECT_THAT(models.commands, HasSubstr("lt 4 lw 1 title 'top_down_tree'"));
  EXPECT_THAT(models.commands, HasSubstr("NaN with lines lt 3 title 'tree'"));
  EXPECT_THAT(models.commands, Not(HasSubstr("lt 3 lw 1 title 'top_down_tree'")));
}

TEST(StudyPlotsTest, GridsOfNoiseHaveThePValuesOfEveryPairTheirAxesAllow) {
  std::vector<std::string> conditions;
  for (const char* goal : {"single", "multi"}) {
    for (const char* model : {"layer_1", "flat", "tree"}) {
      for (const char* noise : {"0.1", "0.2", "0.5", "1", "2", "5"}) {
        conditions.push_back(std::string(goal) + "." + model + ".initial_noise_factor=" + noise);
      }
    }
  }
  const Figures figures = study_plots(grid_of(conditions));
  EXPECT_EQ(num_lines(figures, "p_values"), 6U * 15);
  EXPECT_EQ(num_lines(figures, "p_values_across"), 12U * 3);  // figures C-18 and C-20
  EXPECT_EQ(num_lines(figures, "p_values_across_3"), 18U);
  const Plot models = find(figures, "p_values_across");
  EXPECT_THAT(models.commands, HasSubstr("set title 'multi, initial_noise_factor=5'"));
  EXPECT_THAT(models.commands, HasSubstr("'flat over tree'"));
  EXPECT_THAT(models.caption, HasSubstr("Holm's correction over all roll-outs and all pairs"));
  // The six noises of a goal are two lines of three: none of the other goal stands among them.
  EXPECT_EQ(models.width_px, 1320);
  EXPECT_EQ(models.height_px, 4 * 340 + 40);
  EXPECT_THAT(find(figures, "learning_curves_across").commands,
              HasSubstr("set title 'multi, initial_noise_factor=0.5'"));
  EXPECT_THAT(figures.left_out, IsEmpty());
}

TEST(StudyPlotsTest, EightLinesAreToldApartAndTheOthersHaveAnotherPanel) {
  std::vector<std::string> conditions;
  for (int i = 0; i < 11; ++i) conditions.push_back("c" + std::to_string(i));
  const Figures figures = study_plots(grid_of(conditions));
  EXPECT_EQ(num_lines(figures, "p_values"), 11U * 10 / 2);
  for (const Plot& plot : figures.plots)
    EXPECT_THAT(plot.commands, Not(HasSubstr("lt 9"))) << plot.id;
}

TEST(StudyPlotsTest, WhereTooFewRunsGotNobodyIsAhead) {
  StudyResults study = two_conditions();
  for (int i = 3; i < 6; ++i)
    study.runs[static_cast<std::size_t>(i)].rollouts.resize(i == 3 ? 4 : 3);
  const Plot plot = find(study_plots(study), "p_values");
  EXPECT_THAT(plot.data, HasSubstr("\n3 0 7.69"));
  // The shorter runs end here; a p of 1 was drawn as if "flat" were surely ahead.
  EXPECT_THAT(plot.data, HasSubstr("\n4 NaN NaN NaN\n"));
}

TEST(StudyPlotsTest, MarksAreOfTheWholeFamily) {
  const Plot plot = find(study_plots(two_conditions()), "p_values");
  // Roll-out 2: .5, .6, .7 against 0, .01, .02: t = .59 / sqrt((.01 + .0001) / 3). Of four tests
  // two are certain, so that Holm's factor is 2, and the p is two-sided.
  const auto test = welch_greater({.5, .6, .7}, {0, .01, .02});
  EXPECT_THAT(plot.data, HasSubstr("\n2 " + datum(test->p) + " "));
  EXPECT_THAT(plot.data, HasSubstr(" " + datum(2 * 2 * test->p) + "\n"));
  EXPECT_THAT(plot.commands, HasSubstr("using 1:($4 < .05 ? $3 : NaN) with points lt 1"));
}

TEST(StudyPlotsTest, OfVeryManyRolloutsSomeHaveTheirPDrawn) {
  StudyResults study{.name = "long", .directory = "", .runs = {}};
  for (int run = 0; run < 4; ++run) {
    study.runs.push_back(
        run_with(run < 2 ? "a" : "b", run % 2, run, std::vector<double>(5000, .1 * run)));
  }
  const Plot plot = find(study_plots(study), "p_values");
  EXPECT_EQ(std::count(plot.data.begin(), plot.data.end(), '\n'), 1 + 1000 + 2);
  EXPECT_THAT(plot.caption, HasSubstr("One of 5 roll-outs is drawn."));
}

TEST(StudyPlotsTest, ConditionsOfOneRunHaveNoPValuesAndAreNamed) {
  StudyResults study = grid_of({"a.1", "a.2"});
  for (const char* name : {"b.1", "b.2"}) {
    study.runs.push_back(run_with(name, 0, static_cast<int>(study.runs.size()), {.1}));
  }
  const Figures figures = study_plots(study);
  EXPECT_THAT(figures.left_out,
              testing::ElementsAre(HasSubstr("where a condition has one run: b."),
                                   HasSubstr("where a condition has one run: 1, 2.")));
}

TEST(StudyPlotsTest, TheMeanOverAllRolloutsHasItsIntervalAndItsRuns) {
  StudyResults study{.name = "mine", .directory = "", .runs = {}};
  for (int i = 0; i < 3; ++i) study.runs.push_back(run_with("tree", i, i, {0, .2 * i}));
  const Plot plot = find(study_plots(study), "average_rewards");
  // 0, .1, .2: half width t(2, .975) .1 / sqrt 3 = .248414.
  EXPECT_THAT(plot.data, HasSubstr("# row mean low high runs\n-1 0.1"));
  EXPECT_THAT(plot.data, HasSubstr(" -0.14841"));
  EXPECT_THAT(plot.data, HasSubstr(" 3\n\n\n# reward row\n0 -1\n0.1 -1\n0.2 -1\n"));
  EXPECT_THAT(plot.commands, HasSubstr("'tree (3)' -1"));
}

TEST(StudyPlotsTest, AStudyWithoutAnyRewardIsDrawnFromZero) {
  StudyResults study{.name = "mine", .directory = "", .runs = {}};
  for (int i = 0; i < 2; ++i) study.runs.push_back(run_with("tree", i, i, {0, 0}));
  EXPECT_THAT(find(study_plots(study), "average_rewards").commands, HasSubstr("set xrange [0:1]"));
}

TEST(StudyPlotsTest, RolloutsAreMarkedAtRoundNumbers) {
  StudyResults study{.name = "long", .directory = "", .runs = {}};
  study.runs.push_back(run_with("a", 0, 0, std::vector<double>(150, .1)));
  EXPECT_THAT(study_plots(study).plots.front().commands,
              HasSubstr("set xrange [0:150]; set xtics 50\n"));
}

TEST(StudyPlotsTest, ALongListOfNamesIsCounted) {
  EXPECT_EQ(listed({"a"}), "a");
  EXPECT_EQ(listed({"a", "b", "c", "d", "e", "f", "g"}), "a, b, c, d, e, f, g");
  EXPECT_EQ(listed({"a", "b", "c", "d", "e", "f", "g", "h"}), "a, b, c, d, e, f and 2 more");
}

}  // namespace
}  // namespace treeroll::report
