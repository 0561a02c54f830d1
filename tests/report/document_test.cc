#include "learner/report/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "learner/report/report_sections.h"
#include "tests/results/records.h"

#include <nlohmann/json.hpp>

namespace treeroll::report {
namespace {

using report_test::run_with;
using testing::HasSubstr;
using testing::Not;

Document small() {
  Picture picture{
      .id = "p", .title = "Curves", .caption = "of a", .svg = "<svg/>", .file = "f/p.svg"};
  Table table{.columns = {"a|b"}, .rows = {{{"<script>x</script>", "p"}}}};
  return {.title = "A & B", .sections = {{.id = "s", .title = "One", .blocks = {table, picture}}}};
}

TEST(DocumentTest, HtmlStandsAloneAndEscapesWhatItShows) {
  const std::string html = to_html(small());
  EXPECT_THAT(html, HasSubstr("<title>A &amp; B</title>"));
  EXPECT_THAT(html, HasSubstr("<a href=\"#p\">&lt;script&gt;x&lt;/script&gt;</a>"));
  EXPECT_THAT(html, HasSubstr("<li><a href=\"#s\">One</a></li>"));
  EXPECT_THAT(html, HasSubstr("src=\"data:image/svg+xml;base64,PHN2Zy8+\""));  // <svg/>
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_THAT(html, Not(HasSubstr(std::string(1, '\0'))));
}

TEST(DocumentTest, MarkdownKeepsItsTablesWhole) {
  const std::string text = to_markdown(small());
  EXPECT_THAT(text, HasSubstr("| a\\|b |\n|---|\n| \\<script>x\\</script> |\n"));
  EXPECT_THAT(text, HasSubstr("![Curves](f/p.svg)"));
}

std::vector<StudyResults> two_studies() {
  StudyResults study{.name = "mine", .directory = "/somewhere", .runs = {}};
  for (int i = 0; i < 3; ++i) {
    study.runs.push_back(run_with("flat", i, i, std::vector<double>(6, .2 + .01 * i)));
  }
  for (int i = 0; i < 3; ++i) {
    study.runs.push_back(run_with("tree", i, 3 + i, std::vector<double>(6, .5 + .01 * i)));
    study.runs.back().switches = {2 + i};
  }
  study.runs[4].rollouts[1].status = RolloutStatus::kFailed;
  StudyResults other = study;
  other.name = "other";
  return {study, other};
}

TEST(ReportTest, AComparisonHasPlainAndCorrectedProbabilitiesAtEachRollout) {
  const auto compared = comparisons_within(two_studies()[0]);
  ASSERT_EQ(compared.size(), 1U);
  const Comparison& comparison = compared[0];
  EXPECT_EQ(comparison.p.size(), 6U);
  EXPECT_GT(comparison.end->p, .99);   // flat is not above tree
  EXPECT_EQ(comparison.paired->p, 1);  // the same distance in each repetition
  EXPECT_EQ(comparison.p_holm[0], std::optional(1.));
  EXPECT_LT(*comparison.g, 0);
}

TEST(ReportTest, TwoStudiesAreComparedByConditionWithoutPairs) {
  const std::vector<StudyResults> studies = two_studies();
  const auto compared = comparisons_between(studies[0], studies[1]);
  ASSERT_EQ(compared.size(), 2U);
  EXPECT_EQ(compared[0].a, "mine:flat");
  EXPECT_EQ(compared[0].b, "other:flat");
  EXPECT_NEAR(compared[0].end->p, .5, 1e-12);
  EXPECT_FALSE(compared[0].paired);
}

TEST(ReportTest, EveryTwoConditionsOfOnePartAreCompared) {
  StudyResults study{.name = "mine", .directory = "", .runs = {}};
  const auto add = [&](const std::string& condition) {
    study.runs.push_back(
        run_with(condition, 0, static_cast<int>(study.runs.size()), std::vector<double>(5, .1)));
  };
  for (int i = 0; i < 8; ++i) add("c" + std::to_string(i));
  EXPECT_EQ(comparisons_within(study).size(), 8U * 7 / 2);
  study.runs.clear();
  for (const char* name : {"flat.ode", "flat.rk4", "tree.ode", "tree.rk4"}) add(name);
  const auto compared = comparisons_within(study);
  ASSERT_EQ(compared.size(), 4U);
  EXPECT_EQ(compared[2].a, "flat.ode");
  EXPECT_EQ(compared[2].b, "tree.ode");
  EXPECT_EQ(pairs_left_out(study), "");
}

TEST(ReportTest, OfVeryManyPairsTheFirstStandInTheTableAndItSaysSo) {
  StudyResults study{.name = "mine", .directory = "", .runs = {}};
  for (int i = 0; i < 30; ++i) {
    study.runs.push_back(run_with("c" + std::to_string(i), 0, i, std::vector<double>(5, .1)));
  }
  EXPECT_EQ(comparisons_within(study).size(), 400U);
  EXPECT_THAT(pairs_left_out(study),
              HasSubstr("Of the 435 pairs of mine the first 400 stand here"));
}

TEST(ReportTest, FailuresAndSwitchesAreShownAndNoPathOfTheMachineIs) {
  const StudyResults study = two_studies()[0];
  const Document document{.title = "r", .sections = {study_section(study, {})}};
  const std::string text = to_markdown(document);
  EXPECT_THAT(text, HasSubstr("| tree | 3 | - | 0.510 | \\[0.485, 0.535] | 0.510 |"));
  EXPECT_THAT(text, HasSubstr("| 18 | 1 | 3 |"));  // roll-outs, failed, runs without an end
  EXPECT_THAT(text, HasSubstr("| tree | 3 of 3 | 3.5 | 4 | 4.5 | 3 |"));
  EXPECT_THAT(text, Not(HasSubstr("somewhere")));
}

TEST(ReportTest, WhatIsToBeKnownOfTheFiguresIsWrittenAboveThem) {
  const Picture picture{
      .id = "p", .title = "Curves", .caption = "", .svg = "<svg/>", .file = "f/p.svg"};
  const std::string text = to_markdown(
      {.title = "r", .sections = {study_section(two_studies()[0], {picture}, {"No motion."})}});
  EXPECT_THAT(text, HasSubstr("\n\nNo motion.\n\n![Curves]"));
}

TEST(ReportTest, ClaimsAreCountedAndLinkedToWhatShowsThem) {
  Claim claim;
  claim.text = "tree above flat";
  claim.section = "4-1-2";
  claim.study = "mine";
  claim.conditions = {"tree", "flat"};
  claim.figure = "curves";
  Claim elsewhere = claim;
  elsewhere.study = "none";
  const std::vector<StudyResults> studies = two_studies();
  const std::vector<Claim> claims = {claim, elsewhere};
  const std::vector<ClaimResult> results = {judge(claim, studies), judge(elsewhere, studies)};
  const Picture picture{.id = "mine-curves", .title = "", .caption = "", .svg = "", .file = ""};
  const std::string html =
      to_html({.title = "r", .sections = {claims_section(claims, results, {picture})}});
  EXPECT_THAT(html, HasSubstr("Of 2 claims 1 hold, 0 do not, 0 are inconclusive and 1 were not"));
  EXPECT_THAT(html, HasSubstr("<a href=\"#mine-curves\">"));
  EXPECT_THAT(html, HasSubstr("study none is not among those given"));
  const auto json = nlohmann::json::parse(report_json(claims, results, studies, {}));
  EXPECT_EQ(json["claims"][0]["verdict"], "holds");
  EXPECT_EQ(json["claims"][1]["p"], nullptr);
  EXPECT_EQ(json["claims"][0]["p_holm"], json["claims"][0]["p"]);  // the only one that is tested
  EXPECT_EQ(json["claims"][1]["p_holm"], nullptr);
  EXPECT_EQ(json["studies"][0]["conditions"][1]["first_switch"]["median"], 4);
}

/// A program has from report.json what a person has from the tables.
TEST(ReportTest, TheJsonHasWhatTheTablesHave) {
  std::vector<StudyResults> studies = two_studies();
  studies[0].runs[0].rollouts[1].status = RolloutStatus::kDiverged;
  Claim claim;
  claim.study = "mine";
  claim.conditions = {"tree", "flat"};
  claim.against = {.kind = MeasureKind::kBest};
  claim.margin = -.5;
  Claim share = claim;
  share.kind = ClaimKind::kShare;
  share.high = 1;
  share.share_min = .25;
  const std::vector<Claim> claims = {claim, share};
  const std::vector<ClaimResult> results = {judge(claim, studies), judge(share, studies)};
  const Comparison ahead =
      compare("tree", runs_of(studies[0], "tree"), "flat", runs_of(studies[0], "flat"), true);
  const std::vector<Comparison> comparisons = {ahead, ahead};
  const auto json = nlohmann::json::parse(report_json(claims, results, studies, comparisons));

  const auto& first = json["claims"][0];
  EXPECT_EQ(first["kind"], "greater");
  EXPECT_EQ(first["margin"], -.5);
  EXPECT_EQ(first["against"], "best reward up to the last roll-out");
  EXPECT_EQ(first["range"], nullptr);
  EXPECT_EQ(first["hedges_g"], *results[0].g);
  EXPECT_EQ(json["claims"][1]["kind"], "share");
  EXPECT_EQ(json["claims"][1]["range"], nlohmann::json({0., 1.}));
  EXPECT_EQ(json["claims"][1]["share"], nlohmann::json({.25, 1.}));
  const double p = json["comparisons"][0]["p"];
  EXPECT_LT(p, .01);
  EXPECT_DOUBLE_EQ(json["comparisons"][0]["p_holm"], 2 * p) << "of two";

  const auto& condition = json["studies"][0]["conditions"][0];
  std::vector<double> near_end;
  for (const MeasuredRun& run : runs_of(studies[0], condition["condition"].get<std::string>())) {
    near_end.push_back(measure(run, {}).value());
  }
  EXPECT_EQ(condition["near_end_median"], *median(near_end));
  EXPECT_EQ(condition["runs_without_end"], near_end.size());
  EXPECT_EQ(condition["failed"], 1);
  EXPECT_EQ(condition["failed_by_status"]["diverged"], 1);
  EXPECT_EQ(condition["failed_by_status"]["given_up"], 0);
}

}  // namespace
}  // namespace treeroll::report
