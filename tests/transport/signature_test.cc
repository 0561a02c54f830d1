#include "common/transport/signature.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/transport/message_maker.h"
#include "tests/transport/signing_side.h"

namespace treeroll::transport {
namespace {

using testing::HasSubstr;

std::string hex_of(const std::vector<std::byte>& bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    for (const unsigned digit :
         {std::to_integer<unsigned>(byte) >> 4U, std::to_integer<unsigned>(byte) & 15U}) {
      text += "0123456789abcdef"[digit];
    }
  }
  return text;
}

TEST(SignatureTest, EverySingleBitFlipIsRefused) {
  MessageMaker maker(3);
  for (const Channel channel : kAllChannels) {
    Side learner(learner_ring());
    for (int i = 0; i < 4; ++i) {
      const Signed whole = learner.say(maker.make(channel));
      Side reader(learner_ring());
      ASSERT_EQ(reader.authenticator.refusal(channel, whole.bytes), std::nullopt);
      Signed flipped = whole;
      for (std::size_t bit = 0; bit < 8 * whole.bytes.size(); ++bit) {
        const auto mask = static_cast<std::byte>(1U << (bit % 8));
        flipped.bytes[bit / 8] ^= mask;
        ASSERT_NE(reader.authenticator.refusal(channel, flipped.bytes), std::nullopt)
            << channel_name(channel) << " bit " << bit;
        flipped.bytes[bit / 8] ^= mask;
      }
      for (std::size_t size = 0; size < whole.bytes.size(); ++size) {
        flipped.bytes.assign(whole.bytes.begin(),
                             whole.bytes.begin() + static_cast<std::ptrdiff_t>(size));
        ASSERT_NE(reader.authenticator.refusal(channel, flipped.bytes), std::nullopt) << size;
      }
    }
  }
}

TEST(SignatureTest, WhatIsSignedIsReadAsWhatItWas) {
  MessageMaker maker(4);
  Side side(learner_ring());
  for (int i = 0; i < 200; ++i) {
    for (const Channel channel : kAllChannels) {
      const Message message = maker.make(channel);
      const Signed datagram = side.say(message);
      const auto read = decode(channel, datagram.bytes);
      ASSERT_TRUE(read);
      EXPECT_EQ(*read, message);
    }
  }
}

TEST(SignatureTest, TheChannelIsPartOfWhatIsSigned) {
  Side learner(learner_ring());
  Signed datagram = learner.say(learner_status());
  datagram.channel = Channel::kRunStatus;
  EXPECT_THAT(Side(learner_ring()).hear(datagram), HasSubstr("not what it was signed as"));
}

/// The vectors of lcmtypes/PROTOCOL.md, which the Python package is held to as well.
TEST(SignatureTest, SignsAsTheProtocolSays) {
  Key key{};
  for (std::size_t i = 0; i < key.size(); ++i) key.at(i) = static_cast<unsigned char>(i);
  const WorkerKey worker = worker_key(key, 0x1122334455667788);
  EXPECT_EQ(line_of(worker),
            "worker 1122334455667788 "
            "29187c57d1e5070f0ada7416ca271d3170972fd931d3fc71066411becdbae1dd "
            "485f7831cd64e8beaffde06d35c684825da2f0ae3a6b36e7091b9387f05f59f5");
  Side learner(ring(line_of(key)));
  Side host(ring(line_of(worker)));
  protocol::DefinitionRequest request;
  constexpr std::int64_t kOfHost = 0x1122330000000005;
  request.worker_id = kOfHost;
  request.learner_id = kLearner;
  const Signed asked = host.say(request);
  EXPECT_EQ(hex_of(asked.bytes),
            "a24763953d124f111122330000000005000000000000004d000000001122334455667788000000000000"
            "000105e717c8c56a7af5ae68f0d0a90cbfbb");
  EXPECT_EQ(learner.authenticator.refusal(asked.channel, asked.bytes), std::nullopt);
  protocol::RolloutBatch batch = batch_to({kOfHost});
  batch.sequence = 1;
  const Signed greeting = learner.say(batch);
  EXPECT_EQ(hex_of(greeting.bytes),
            "2c15d9f22cac70e3000000000000004d0000000000000001000000000000000111223300000000050000"
            "00000000000000000000000000000000000116b71174e78dc7b1201976b38331c2337ef24e3a707c1bcf"
            "0000000000000001142a2e4b67169af0136f643c7e08132b");
}

}  // namespace
}  // namespace treeroll::transport
