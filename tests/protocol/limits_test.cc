#include "common/protocol/limits.h"

#include <gtest/gtest.h>

#include <compare>

#include "common/protocol/messages.h"
#include "common/protocol/wire_sizes.h"

namespace treeroll::protocol {
namespace {

TEST(LimitsTest, AMessageFitsOneDatagram) {
  constexpr std::size_t kDatagramBytesMax = 65507;  // UDP over IPv4
  EXPECT_LE(kMessageBytesMax + kFrameBytesMax, kDatagramBytesMax);
}

TEST(LimitsTest, ABatchAcrossHostsFitsOneEthernetFrame) {
  constexpr std::size_t kFrameBytesMax = 1500;
  constexpr std::size_t kHeaderBytes = 20 + 8 + 4 + 4 + 18;  // IP, UDP, LCM, TREEROLL_ROLLOUTS
  EXPECT_LE(kBatchBytesRemoteMax + kHeaderBytes, kFrameBytesMax);
}

TEST(LimitsTest, BatchesFitAMessage) {
  EXPECT_LT(kBatchBytesLocalMax, kMessageBytesMax);
  EXPECT_LT(kBatchBytesRemoteMax, kBatchBytesLocalMax);
  EXPECT_LE(kRolloutBatchBytes + rollout_request_bytes(kThetaDimMax), kMessageBytesMax);
}

TEST(MessagesTest, RolloutsAreOrderedByRunAndThenByNumber) {
  EXPECT_LT((RolloutKey{0, 7}), (RolloutKey{1, 0}));
  EXPECT_LT((RolloutKey{1, -2}), (RolloutKey{1, -1}));
  EXPECT_EQ((RolloutKey{1, 2}), (RolloutKey{1, 2}));
}

TEST(MessagesTest, DifferInEveryPart) {
  RolloutBatch batch;
  batch.rollouts.assign(2, {});
  batch.rollouts[1].theta = {1, 2};
  RolloutBatch other = batch;
  EXPECT_EQ(batch, other);
  other.rollouts[1].theta[1] = 3;
  EXPECT_NE(batch, other);
  EXPECT_NE(Message(batch), Message(RewardBatch{}));
}

}  // namespace
}  // namespace treeroll::protocol
