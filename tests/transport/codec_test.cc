#include "common/transport/codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"
#include "tests/transport/message_maker.h"

namespace treeroll::transport {
namespace {

using protocol::Message;

TEST(CodecTest, EveryMessageComesBackAsItWent) {
  for (const Channel channel : kAllChannels) {
    for (std::uint64_t seed = 0; seed < 500; ++seed) {
      const Message message = MessageMaker(seed).make(channel);
      ASSERT_EQ(channel_of(message), channel);
      const auto bytes = encode(message);
      const Result<Message> back = decode(channel, bytes);
      ASSERT_TRUE(back) << back.error().message << ", seed " << seed;
      ASSERT_EQ(*back, message) << channel_name(channel) << ", seed " << seed;
      ASSERT_EQ(encode(*back), bytes) << channel_name(channel) << ", seed " << seed;
    }
  }
}

TEST(CodecTest, EveryMessageEndsWithSixteenZerosForTheAuthenticationCode) {
  for (const Channel channel : kAllChannels) {
    const auto bytes = encode(MessageMaker(1).make(channel));
    ASSERT_GE(bytes.size(), 8U + 16U);
    EXPECT_TRUE(std::all_of(bytes.end() - 16, bytes.end(),
                            [](std::byte byte) { return byte == std::byte{0}; }));
  }
}

TEST(CodecTest, ReadsMessagesThatCarryAnAuthenticationCode) {
  for (const Channel channel : kAllChannels) {
    const Message message = MessageMaker(2).make(channel);
    auto bytes = encode(message);
    std::fill(bytes.end() - 16, bytes.end(), std::byte{0xa5});
    const Result<Message> back = decode(channel, bytes);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, message);
  }
}

TEST(CodecTest, NoTwoTypesShareAFingerprint) {
  std::set<std::vector<std::byte>> fingerprints;
  for (const Channel channel : kAllChannels) {
    auto bytes = encode(MessageMaker(3).make(channel));
    bytes.resize(8);
    fingerprints.insert(bytes);
  }
  EXPECT_EQ(fingerprints.size(), kAllChannels.size());
}

TEST(CodecTest, AMessageOnAnothersChannelIsRefused) {
  for (const Channel sent : kAllChannels) {
    const auto bytes = encode(MessageMaker(4).make(sent));
    for (const Channel heard : kAllChannels) {
      EXPECT_EQ(refusal(heard, bytes).has_value(), sent != heard);
    }
  }
}

TEST(CodecTest, FullBatchesOfOrdinarySizeFitTheirLimits) {
  // 12 parameters, as the swing-up's flat policy: what a person should be able to count on.
  protocol::RolloutBatch batch;
  batch.rollouts.assign(300, {});
  for (auto& rollout : batch.rollouts) rollout.theta.assign(12, 0.25);
  EXPECT_LE(encode(batch).size(), protocol::kBatchBytesLocalMax);
  batch.rollouts.resize(7);
  EXPECT_LE(encode(batch).size(), protocol::kBatchBytesRemoteMax);
}

TEST(CodecTest, TheLargestThetaFitsAMessage) {
  protocol::RolloutBatch batch;
  batch.rollouts.assign(1, {});
  batch.rollouts[0].theta.assign(protocol::kThetaDimMax, 1.0);
  EXPECT_EQ(refusal(Channel::kRolloutBatch, encode(batch)), std::nullopt);
}

/// What a sender does not fill up to a size is never larger than a frame, however long its texts.
TEST(CodecTest, TheLargestOfWhatIsNotCutFitsAFrame) {
  const std::string name(protocol::kNameBytesMax, 'n');
  const std::string line(protocol::kStringBytesMax, 'l');
  const std::string piece(protocol::kPieceBytes, '\xff');
  protocol::DefinitionReport report;
  report.text = line;
  protocol::LearnerStatus learner;
  learner.study = name;
  learner.waiting_for = line;
  protocol::RunStatus run;
  run.condition = name;
  protocol::BestPolicy best;
  best.condition = name;
  best.policy = piece;
  protocol::DefinitionPiece definition;
  definition.bytes = piece;
  for (const Message& message : std::vector<Message>{report, learner, run, best, definition}) {
    const auto bytes = encode(message);
    const char* channel = channel_name(channel_of(message));
    EXPECT_EQ(refusal(channel_of(message), bytes), std::nullopt);
    EXPECT_LE(protocol::kFrameHeaderBytes + std::string(channel).size() + 1 + bytes.size(),
              protocol::kBatchBytesRemoteMax)
        << channel;
  }
}

}  // namespace
}  // namespace treeroll::transport
