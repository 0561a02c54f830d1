#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "learner/app/claims_file.h"
#include "learner/report/claim.h"
#include "tests/thesis/run_study.h"

/// The claims of deploy/thesis_claims.toml that hold, each by its own test at the level of 5 %, on
/// studies of 30 repetitions with another seed than the shipped one. The names cite the sections.
namespace treeroll {
namespace {

const std::filesystem::path kStudies = TREEROLL_STUDIES_DIR;
constexpr const char* kSeed = "study.seed=3";

StudyResults learn(const std::string& name, std::vector<std::string> overrides = {}) {
  overrides.emplace_back(kSeed);
  return {.name = name, .directory = "", .runs = run_study(kStudies / (name + ".toml"), overrides)};
}

class ClaimsTest : public testing::Test {
 protected:
  /// Every claim of the section whose text begins so, on the study given; at least one.
  static void expect_holds(const StudyResults& study, const std::string& section,
                           const std::string& begin, Verdict expected = Verdict::kHolds) {
    static const std::vector<Claim> claims =
        read_claims(kStudies.parent_path() / "thesis_claims.toml");
    int num_judged = 0;
    for (const Claim& claim : claims) {
      if (claim.study != study.name || claim.section != section) continue;
      if (!claim.text.starts_with(begin)) continue;
      const ClaimResult result = judge(claim, {study});
      EXPECT_EQ(result.verdict, expected)
          << claim.text << ": " << name(result.verdict) << ", " << result.measured << ", p "
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
  expect_holds(first(), "4-1-2",
               "Several resolutions: the tree is ahead in the steepest part, near roll-out 50");
}

TEST_F(ClaimsTest, Section412TheTreeFollowsLayer1AndKeepsRising) {
  expect_holds(first(), "4-1-2", "The tree first follows layer 1");
  expect_holds(first(), "4-1-2", "As layer 1 converges the tree keeps rising");
}

TEST_F(ClaimsTest, Section412TheFlatModelIsAheadWithASingleResolution) {
  expect_holds(first(), "4-1-2", "Single resolution without offset: the flat model outperforms");
  expect_holds(first(), "4-1-2", "Single resolution: the tree sticks to layer 1");
}

TEST_F(ClaimsTest, Section412Layer1AloneEndsLowerAndNeedsTheSecond) {
  expect_holds(first(), "4-1-2", "Layer 1 alone ends much lower");
  expect_holds(first(), "4-1-2", "The second layer is required");
}

TEST_F(ClaimsTest, Section412FlatModelAndTreeConvergeToAboutTheSame) {
  expect_holds(first(), "4-1-2", "Flat model and tree converge to about the same reward");
}

TEST_F(ClaimsTest, Section422TheTreeIsAheadBetween50And120AndThenTheSame) {
  expect_holds(second(), "4-2-2", "Several resolutions: the tree");
  expect_holds(second(), "4-2-2", "After about 120 roll-outs both perform about the same");
}

TEST_F(ClaimsTest, Section422TheSecondLayerIsRequired) {
  expect_holds(second(), "4-2-2", "The second layer is required");
  expect_holds(second(), "4-2-2", "Flat model and tree converge to about the same reward");
}

TEST_F(ClaimsTest, Section44TheTreeConvergesFasterWithSeveralResolutionsAndLosesLittleWithout) {
  expect_holds(first(), "4-4", "The tree converges faster");
  expect_holds(second(), "4-4", "The tree converges faster");
  // Experiment I without offset loses about .09 with some seeds: not certain below .1.
  expect_holds(
      first(), "4-4",
      "Without several resolutions the tree loses only little, experiment I (single_offset)");
  expect_holds(second(), "4-4", "Without several resolutions the tree loses only little");
}

TEST_F(ClaimsTest, Section412TheLargestMinimumNoiseEndsLowestAndSwitchesFirst) {
  const StudyResults study = learn(
      "thesis_4_1_minimum_noise",
      {R"(axes=[{options=[{name="multi", task.goal.outputs=[1.25, 0.75, -0.75, -1.25]}]},)"
       R"( {options=[{name="flat", policy.model="flat"},)"
       R"( {name="tree", exploration.first_layer=1, exploration.last_layer=2}]},)"
       R"( {key="exploration.minimum_noise_fraction", values=[1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2]}])"});
  expect_holds(study, "4-1-2", "The largest minimum noise, 5e-2, ends lowest");
  expect_holds(study, "4-1-2", "The smallest minimum noise, 1e-3, learns slowest");
  expect_holds(study, "4-1-2", "The larger the minimum noise, the fewer roll-outs");
}

TEST_F(ClaimsTest, Sections412And44ReuseOfExperiencePreventsTheDropAfterALargeInitialNoise) {
  const StudyResults study = learn("thesis_4_1_reuse");
  expect_holds(study, "4-1-2", "Reuse of experience is beneficial for large");
  expect_holds(study, "4-1-2", "With and without reuse perform about equally for small noise");
  expect_holds(study, "4-4", "Large initial noise without reuse: the reward drops");
  expect_holds(study, "4-4", "Reuse prevents the drop");
}

}  // namespace
}  // namespace treeroll
