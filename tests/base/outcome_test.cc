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

}  // namespace
}  // namespace treeroll
