#include <gtest/gtest.h>

#include "common/protocol/timings.h"

namespace treeroll::protocol {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(HeartbeatsTest, OfFewWorkersAreTheUsualOnes) {
  for (const int count : {-5, 0, 1, 64}) {
    const Heartbeats beats = heartbeats_of(count);
    EXPECT_EQ(beats.busy, kBusyHeartbeat);
    EXPECT_EQ(beats.idle, kIdleHeartbeat);
    EXPECT_EQ(beats.alive, kWorkerAlive);
    EXPECT_EQ(beats.silence, kWorkerSilence);
    EXPECT_EQ(beats.held_lease_min, kHeldLeaseMin);
  }
}

TEST(HeartbeatsTest, OfManyWorkersTogetherStayHundredsASecond) {
  for (int count = 200; count <= static_cast<int>(kWorkersMax); ++count) {
    const Heartbeats beats = heartbeats_of(count);
    // Intervals are whole milliseconds.
    EXPECT_LE(count / to_seconds(beats.busy), 1.005 * kHeartbeatsPerSecondMax);
    EXPECT_LE(count / to_seconds(beats.idle), 1.005 * kHeartbeatsPerSecondMax);
  }
}

TEST(HeartbeatsTest, SilenceIsWaitedForInProportion) {
  const Heartbeats beats = heartbeats_of(4096);
  EXPECT_EQ(beats.busy, milliseconds(6400));
  EXPECT_EQ(beats.idle, milliseconds(6400));
  EXPECT_EQ(beats.alive, milliseconds(15360));
  EXPECT_EQ(beats.silence, milliseconds(76800));
  EXPECT_EQ(beats.held_lease_min, seconds(64));
}

/// Whatever a learner says: a worker never sleeps for hours.
TEST(HeartbeatsTest, MoreThanTheMostWorkersAreTheMost) {
  EXPECT_EQ(heartbeats_of(2'000'000'000).idle, heartbeats_of(kWorkersMax).idle);
  EXPECT_LT(heartbeats_of(2'000'000'000).idle, seconds(7));
}

}  // namespace
}  // namespace treeroll::protocol
