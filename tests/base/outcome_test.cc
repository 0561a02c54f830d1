#include "common/base/outcome.h"

#include <gtest/gtest.h>

namespace treeroll {
namespace {

TEST(OutcomeTest, HasARewardOnlyIfItIsOk) {
  EXPECT_EQ(Outcome::ok(.5).reward(), .5);
  EXPECT_TRUE(Outcome::ok(.5).is_ok());
  for (const RolloutStatus status : {RolloutStatus::kDiverged, RolloutStatus::kFailed,
                                     RolloutStatus::kCrashed, RolloutStatus::kTimedOut}) {
    EXPECT_EQ(Outcome(.5, status), Outcome::failed(status)) << "what comes from outside";
    EXPECT_EQ(Outcome(.5, status).reward(), 0);
    EXPECT_EQ(Outcome(.5, status).status(), status);
    EXPECT_FALSE(Outcome(.5, status).is_ok());
  }
  EXPECT_EQ(Outcome(.5, RolloutStatus::kOk), Outcome::ok(.5));
}

TEST(OutcomeTest, HasAReasonOnlyIfItIsNotOk) {
  EXPECT_EQ(Outcome::failed(RolloutStatus::kDiverged, "why").reason(), "why");
  EXPECT_EQ(Outcome(.5, RolloutStatus::kOk, "no reason").reason(), "");
}

TEST(OutcomeTest, AgreesWithAnotherWhateverTheirReasons) {
  const Outcome diverged = Outcome::failed(RolloutStatus::kDiverged, "one");
  EXPECT_TRUE(diverged.agrees_with(Outcome::failed(RolloutStatus::kDiverged, "another")));
  EXPECT_NE(diverged, Outcome::failed(RolloutStatus::kDiverged, "another"));
  EXPECT_FALSE(diverged.agrees_with(Outcome::failed(RolloutStatus::kFailed, "one")));
  EXPECT_FALSE(Outcome::ok(.5).agrees_with(Outcome::ok(.25)));
}

TEST(OutcomeTest, ADiscardedTrialIsNoResult) {
  const Outcome discarded = Outcome::discarded("the operator has caught the arm");
  EXPECT_TRUE(discarded.is_discarded());
  EXPECT_FALSE(discarded.is_ok());
  EXPECT_EQ(discarded.reward(), 0);
  EXPECT_FALSE(Outcome::failed(RolloutStatus::kFailed).is_discarded());
}

TEST(OutcomeTest, EachStatusHasAWordThatIsReadBack) {
  for (int i = 0; i < kNumRolloutStatuses; ++i) {
    const auto status = static_cast<RolloutStatus>(i);
    EXPECT_EQ(rollout_status(name(status)), status);
  }
  EXPECT_EQ(rollout_status("fine"), std::nullopt);
}

}  // namespace
}  // namespace treeroll
