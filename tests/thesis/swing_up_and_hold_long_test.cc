#include <gtest/gtest.h>

#include "learner/report/claims_file.h"
#include "learner/report/statistics/claim.h"
#include "tests/thesis/studies.h"
#include "tests/thesis/swing_up_and_hold.h"

namespace treeroll {
namespace {

/// With a seed that had no part in the study's.
TEST(SwingUpAndHoldLongTest, TwentyPoliciesHoldFiftyPlantsEachAndTheClaimsHold) {
  const StudyResults study{
      .name = "swing_up_and_hold",
      .directory = "",
      .runs = run_study(kStudies / "swing_up_and_hold.toml", {"study.seed=11"})};
  const Held closed = count_held(study.runs, "closed");
  EXPECT_EQ(closed.plants, 1000);
  EXPECT_EQ(closed.held, 1000);
  EXPECT_EQ(count_held(study.runs, "open").held, 0);
  const auto claims = report::read_claims(kStudies.parent_path() / "hold_claims.toml");
  for (const report::Claim& claim : claims) {
    const report::ClaimResult result = report::judge(claim, {study});
    EXPECT_EQ(result.verdict, report::Verdict::kHolds) << claim.text << ": " << result.measured;
  }
  EXPECT_GE(claims.size(), 3U);
}

}  // namespace
}  // namespace treeroll
