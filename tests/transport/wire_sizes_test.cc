#include "common/protocol/wire_sizes.h"

#include <gtest/gtest.h>

#include <string>

#include "common/protocol/messages.h"
#include "common/transport/codec.h"

namespace treeroll::transport {
namespace {

using protocol::Message;

std::size_t size_of(const Message& message) { return encode(message).size(); }

TEST(WireSizesTest, AFrameHasTheLongestNameLcmTakes) {
  for (int i = 0; i < kNumChannels; ++i) {
    const std::string name = channel_name(static_cast<Channel>(i));
    EXPECT_LE(4 + 4 + name.size() + 1, protocol::kFrameBytesMax) << name;
  }
}

TEST(WireSizesTest, EmptyMessagesAreWhatTheEncoderWrites) {
  EXPECT_EQ(size_of(protocol::RolloutBatch{}), protocol::kRolloutBatchBytes);
  EXPECT_EQ(size_of(protocol::RewardBatch{}), protocol::kRewardBatchBytes);
  EXPECT_EQ(size_of(protocol::DefinitionRequest{}), protocol::kDefinitionRequestBytes);
  EXPECT_EQ(size_of(protocol::TaskDefinition{}), protocol::kDefinitionBytes);
  EXPECT_EQ(size_of(protocol::PolicyDefinition{}), protocol::kDefinitionBytes);
}

TEST(WireSizesTest, ARolloutBatchGrowsByItsParts) {
  protocol::RolloutBatch batch;
  batch.acknowledgements.resize(3);
  EXPECT_EQ(size_of(batch), protocol::kRolloutBatchBytes + 3 * protocol::kAcknowledgementBytes);
  batch.acknowledgements.clear();
  batch.rollouts.resize(2);
  batch.rollouts[1].theta.assign(7, 0.5);
  EXPECT_EQ(size_of(batch), protocol::kRolloutBatchBytes + protocol::rollout_request_bytes(0) +
                                protocol::rollout_request_bytes(7));
}

TEST(WireSizesTest, ARewardBatchGrowsByItsParts) {
  protocol::RewardBatch batch;
  batch.results.resize(3);
  batch.held.resize(5);
  const std::size_t size = protocol::kRewardBatchBytes + 3 * protocol::rollout_result_bytes(0) +
                           5 * protocol::kRolloutKeyBytes;
  EXPECT_EQ(size_of(batch), size);
  batch.results[1].outcome = Outcome::failed(RolloutStatus::kFailed, "reason");
  EXPECT_EQ(size_of(batch), size + 6);
}

TEST(WireSizesTest, DefinitionsGrowByHashesAndByTheirText) {
  protocol::DefinitionRequest request;
  request.task_ids.resize(2);
  request.policy_ids.resize(3);
  EXPECT_EQ(size_of(request), protocol::kDefinitionRequestBytes + 5 * protocol::kContentHashBytes);
  EXPECT_EQ(size_of(protocol::TaskDefinition{.learner_id = 1, .task_id = {}, .content = "ab"}),
            protocol::kDefinitionBytes + 2);
}

}  // namespace
}  // namespace treeroll::transport
