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
  EXPECT_EQ(size_of(protocol::DefinitionPiece{}), protocol::kDefinitionPieceBytes);
  EXPECT_EQ(size_of(protocol::WorkerStatus{}), protocol::kWorkerStatusBytes);
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

TEST(WireSizesTest, ARequestWhoseThetaComesInPiecesNamesIt) {
  protocol::RolloutBatch batch;
  batch.rollouts.resize(1);
  batch.rollouts[0].theta_id.emplace();
  EXPECT_EQ(size_of(batch), protocol::kRolloutBatchBytes + protocol::kRequestByNameBytes);
}

TEST(WireSizesTest, AStatusGrowsByWhatIsHeld) {
  protocol::WorkerStatus status;
  status.held.resize(2);
  status.held[1].keys.resize(3);
  EXPECT_EQ(size_of(status), protocol::kWorkerStatusBytes + 2 * protocol::kHeldRolloutsBytes +
                                 3 * protocol::kRolloutKeyBytes);
}

TEST(WireSizesTest, ARewardBatchGrowsByItsParts) {
  protocol::RewardBatch batch;
  batch.results.resize(3);
  const std::size_t size = protocol::kRewardBatchBytes + 3 * protocol::rollout_result_bytes(0);
  EXPECT_EQ(size_of(batch), size);
  batch.results[1].outcome = Outcome::failed(RolloutStatus::kFailed, "reason");
  EXPECT_EQ(size_of(batch), size + 6);
}

TEST(WireSizesTest, DefinitionsGrowByNamesAndByTheirBytes) {
  protocol::DefinitionRequest request;
  request.definitions.resize(2);
  request.definitions[1].pieces.resize(3);
  EXPECT_EQ(size_of(request), protocol::kDefinitionRequestBytes +
                                  protocol::wanted_definition_bytes(0) +
                                  protocol::wanted_definition_bytes(3));
  protocol::DefinitionPiece piece;
  piece.bytes = "ab";
  EXPECT_EQ(size_of(piece), protocol::kDefinitionPieceBytes + 2);
}

}  // namespace
}  // namespace treeroll::transport
