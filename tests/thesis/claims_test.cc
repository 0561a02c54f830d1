#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "learner/report/claims_file.h"
#include "learner/report/statistics/claim.h"
#include "tests/thesis/run_study.h"
#include "tests/thesis/studies.h"

/// The claims of deploy/thesis_claims.toml that hold, each by its own test at the level of 5 %, on
/// studies of 30 repetitions. The names cite the sections.
///
/// Which claims stand here was decided by the shipped studies alone (seed 1): those that hold with
/// p < .001, or whose interval lies well inside what is claimed. The seed below had no part in
/// that. One claim that qualified did not pass the test and is left out: section 4-2-2, "after
/// about 120 roll-outs both perform about the same" is inconclusive with seed 11, the tree .05
/// ahead. That a claim is missing here does not mean that it fails; deploy/thesis judges all.
namespace treeroll {
namespace {

constexpr const char* kSeed = "study.seed=11";

StudyResults learn(const std::string& name, std::vector<std::string> overrides = {}) {
  overrides.emplace_back(kSeed);
  return {.name = name, .directory = "", .runs = run_study(kStudies / (name + ".toml"), overrides)};
}

class ClaimsTest : public testing::Test {
 protected:
  /// Every claim of the section whose text begins so, on the study given; at least one.
  static void expect_holds(const StudyResults& study, const std::string& section,
                           const std::string& begin,
                           report::Verdict expected = report::Verdict::kHolds) {
    static const std::vector<report::Claim> claims =
        report::read_claims(kStudies.parent_path() / "thesis_claims.toml");
    int num_judged = 0;
    for (const report::Claim& claim : claims) {
      if (claim.study != study.name || claim.section != section) continue;
      if (!claim.text.starts_with(begin)) continue;
      const report::ClaimResult result = report::judge(claim, {study});
      EXPECT_EQ(result.verdict, expected)
          << claim.text << ": " << report::name(result.verdict) << ", " << result.measured << ", p "
          << result.p.value_or(-1) << " (" << kSeed << ")";
      ++num_judged;
    }
    EXPECT_GT(num_judged, 0) << "no claim of section " << section << " begins: " << begin;
  }

  static const StudyResults& first() {
    static const StudyResults study = learn("thesis_4_1");
    return study;
  }
  static const StudyResults& second() {
    static const StudyResults study = learn("thesis_4_2");
    return study;
  }
};

TEST_F(ClaimsTest, Section412TheTreeIsAheadInTheSteepestPart) {
  expect_holds(first(), "4-1-2", "Several resolutions: the tree is the faster learner");
  expect_holds(
      first(), "4-1-2",
      "Several resolutions: the tree is ahead in the steepest part, near roll-out 50 (figure 4-6, "
      "multi)");
}

TEST_F(ClaimsTest, Section412TheTreeFollowsLayer1AndKeepsRising) {
  expect_holds(first(), "4-1-2", "Several resolutions: the tree first follows layer 1");
  expect_holds(first(), "4-1-2", "Several resolutions: as layer 1 converges the tree keeps rising");
}

TEST_F(ClaimsTest, Section412TheFlatModelIsAheadWithASingleResolution) {
  expect_holds(first(), "4-1-2", "Single resolution without offset: the flat model outperforms");
  expect_holds(first(), "4-1-2", "Single resolution without offset: the tree sticks to layer 1");
  expect_holds(first(), "4-1-2",
               "Single resolution: the tree is not faster than the flat model, over the first 200 "
               "roll-outs (single)");
}

TEST_F(ClaimsTest, Section412Layer1AloneEndsLowerAndNeedsTheSecond) {
  expect_holds(first(), "4-1-2", "Layer 1 alone ends much lower");
  expect_holds(first(), "4-1-2",
               "Several resolutions: layer 1 does add value, a gain of more than .1");
  for (const char* goal : {"(single)", "(single_offset)", "(multi)"}) {
    expect_holds(first(), "4-1-2",
                 std::string("The second layer is required for the best performance ") + goal);
  }
}

TEST_F(ClaimsTest, Section412FlatModelAndTreeConvergeToAboutTheSame) {
  for (const char* goal : {"(single)", "(multi)"}) {
    expect_holds(first(), "4-1-2",
                 std::string("Flat model and tree converge to about the same reward ") + goal);
  }
}

TEST_F(ClaimsTest, Section422TheTreeIsAheadInTheSteepestPart) {
  expect_holds(second(), "4-2-2",
               "Several resolutions: the tree outperforms the flat model in the steepest part");
}

TEST_F(ClaimsTest, Section422FlatModelAndTreeConvergeTowardsTheOptimum) {
  expect_holds(second(), "4-2-2", "Flat model and tree converge towards the optimal trajectory");
}

TEST_F(ClaimsTest, Section44TheTreeConvergesFasterWithSeveralResolutions) {
  expect_holds(first(), "4-4", "The tree converges faster");
  expect_holds(first(), "4-4",
               "Several resolutions: the tree follows layer 1 until that begins to converge, over "
               "the first 50 roll-outs (multi_offset)");
  expect_holds(first(), "4-4",
               "Several resolutions: from there the tree's curve stays steep, above layer 1 near "
               "roll-out 150 (multi)");
}

TEST_F(ClaimsTest, Section44WithoutSeveralResolutionsLayer1CostsALittle) {
  expect_holds(
      first(), "4-4",
      "Without several resolutions the tree performs slightly lower, experiment I (single)");
  expect_holds(second(), "4-4", "Without several resolutions the tree performs slightly lower");
  expect_holds(
      first(), "4-4",
      "Without several resolutions the tree loses only little, experiment I (single_offset)");
  expect_holds(first(), "4-4", "Single resolution: the tree sticks to layer 1");
  expect_holds(second(), "4-4", "Single resolution: the tree sticks to layer 1");
  expect_holds(first(), "4-4",
               "Single resolution: exploring layer 1 costs performance, the flat model is ahead up "
               "to roll-out 200, experiment I (single)");
  expect_holds(second(), "4-4", "Single resolution: exploring layer 1 costs performance");
}

TEST_F(ClaimsTest, Section412TheLargestMinimumNoiseEndsLowestAndSwitchesFirst) {
  const StudyResults study = learn(
      "thesis_4_1_minimum_noise",
      {R"(axes=[{options=[{name="multi", task.goal.outputs=[1.25, 0.75, -0.75, -1.25]}]},)"
       R"( {options=[{name="flat", policy.model="flat"},)"
       R"( {name="tree", exploration.first_layer=1, exploration.last_layer=2}]},)"
       R"( {key="exploration.minimum_noise_fraction", values=[1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2]}])"});
  expect_holds(study, "4-1-2", "The largest minimum noise, 5e-2, gives the lowest rewards");
  expect_holds(study, "4-1-2", "With the larger minimum noises learning fails to converge");
  expect_holds(study, "4-1-2", "The larger the minimum noise, the fewer roll-outs");
}

TEST_F(ClaimsTest, Sections412And44ReuseOfExperiencePreventsTheDropAfterALargeInitialNoise) {
  const StudyResults study = learn("thesis_4_1_reuse");
  expect_holds(study, "4-1-2",
               "Reuse of experience is beneficial for large initial noise, near roll-out 100");
  expect_holds(study, "4-1-2",
               "With and without reuse perform about equally for smaller initial noise, over all "
               "roll-outs (gamma 0.1)");
  expect_holds(study, "4-4", "Large initial noise without reuse: the reward drops");
  expect_holds(study, "4-4", "Large initial noise with reuse: the reward does not drop");
  expect_holds(study, "4-4", "Large initial noise: reuse lessens the drop");
  for (const char* goal : {"(single)", "(single_offset)"}) {
    expect_holds(
        study, "4-4",
        std::string("Without reuse the drop is less severe for small initial noise, 0.1, than for "
                    "5 ") +
            goal);
  }
}

// On the equations of motion alone: the Open Dynamics Engine takes minutes.
TEST_F(ClaimsTest, Sections432And44TheSwingUpIsNotLearntAndTheTreeLosesLittle) {
  const StudyResults study = learn(
      "thesis_4_3",
      {R"(axes=[{name="plants", options=[{name="rk4", task.plant="rk4", task.step_s=0.005}]}])"});
  for (const char* model : {"flat", "layer_1", "layer_2", "tree"}) {
    expect_holds(study, "4-3-2",
                 std::string("No guarantee of a working controller after 200 roll-outs: fewer than "
                             "95 % of the runs reach .99 (") +
                     model + ".rk4)");
  }
  expect_holds(study, "4-4", "The tree does not lose much against layer 2 on the swing-up (rk4)");
}

}  // namespace
}  // namespace treeroll
