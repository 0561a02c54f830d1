#include "common/transport/short_frame.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "tests/transport/message_maker.h"

namespace treeroll::transport {
namespace {

std::optional<ShortFrame> read(const std::string& datagram) {
  return read_short_frame(std::as_bytes(std::span(datagram.data(), datagram.size())));
}

std::string header(const std::string& magic = "LC02") { return magic + std::string(4, '\1'); }

TEST(ShortFrameTest, HoldsChannelAndPayload) {
  using namespace std::string_literals;
  const std::string datagram = header() + "TREEROLL_RUNS\0abc"s;
  const auto frame = read(datagram);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->channel, "TREEROLL_RUNS");
  ASSERT_EQ(frame->payload.size(), 3U);
  EXPECT_EQ(frame->payload[0], std::byte{'a'});
}

TEST(ShortFrameTest, MayBeEmptyInEveryPart) {
  const std::string datagram = header() + std::string(1, '\0');
  const auto frame = read(datagram);
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->channel.empty());
  EXPECT_TRUE(frame->payload.empty());
}

TEST(ShortFrameTest, RefusesWhatIsNoShortMessage) {
  EXPECT_FALSE(read(""));
  EXPECT_FALSE(read("LC02"));
  EXPECT_FALSE(read(header()));
  EXPECT_FALSE(read(header() + "x"));  // nine bytes without a NUL
  EXPECT_FALSE(read(header("LC03") + "CHANNEL" + std::string(1, '\0')));
  EXPECT_FALSE(read(header("20CL") + "CHANNEL" + std::string(1, '\0')));
  EXPECT_FALSE(read(header() + std::string(64, 'x') + std::string(1, '\0')));
  EXPECT_TRUE(read(header() + std::string(63, 'x') + std::string(1, '\0')));
}

/// What the kernel would do with a packet: the few instructions the filter uses.
std::uint32_t run_filter(const std::vector<sock_filter>& program, const std::string& datagram) {
  const std::string packet = std::string(8, '\xee') + datagram;
  std::uint32_t accumulator = 0;
  for (std::size_t at = 0; at < program.size(); ++at) {
    const sock_filter& step = program[at];
    switch (step.code) {
      case BPF_LD | BPF_ABS | BPF_W:
      case BPF_LD | BPF_ABS | BPF_H:
      case BPF_LD | BPF_ABS | BPF_B: {
        const int width = BPF_SIZE(step.code) == BPF_W ? 4 : BPF_SIZE(step.code) == BPF_H ? 2 : 1;
        if (step.k + static_cast<std::size_t>(width) > packet.size()) return 0;
        accumulator = 0;
        for (int i = 0; i < width; ++i) {
          accumulator = accumulator << 8 |
                        static_cast<unsigned char>(packet[step.k + static_cast<std::size_t>(i)]);
        }
        break;
      }
      case BPF_JMP | BPF_JEQ | BPF_K:
        at += accumulator == step.k ? step.jt : step.jf;
        break;
      case BPF_JMP | BPF_JA:
        at += step.k;
        break;
      case BPF_RET | BPF_K:
        return step.k;
      default:
        ADD_FAILURE() << "instruction " << step.code;
        return 0;
    }
  }
  ADD_FAILURE() << "fell off the end";
  return 0;
}

TEST(ShortFrameTest, TheFilterPassesWantedChannelsAndNothingElse) {
  const std::string payload(24, '\0');  // the least a message of ours has
  for (unsigned wanted = 0; wanted < 1U << kAllChannels.size(); wanted += 7) {
    std::vector<Channel> channels;
    for (std::size_t i = 0; i < kAllChannels.size(); ++i) {
      if ((wanted >> i & 1U) != 0) channels.push_back(kAllChannels[i]);
    }
    const auto program = short_frame_filter(channels);
    for (std::size_t i = 0; i < kAllChannels.size(); ++i) {
      const std::string name = channel_name(kAllChannels[i]);
      const bool is_wanted = (wanted >> i & 1U) != 0;
      const std::string nul(1, '\0');
      EXPECT_EQ(run_filter(program, header() + name + nul + payload) != 0, is_wanted) << name;
      EXPECT_EQ(run_filter(program, header() + name + "X" + nul + payload), 0U);
      EXPECT_EQ(run_filter(program, header("LC03") + name + nul + payload), 0U);
      EXPECT_EQ(run_filter(program, header() + "X" + name + nul + payload), 0U);
    }
  }
}

TEST(ShortFrameTest, TheFilterDropsGarbage) {
  const auto program = short_frame_filter(kAllChannels);
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    std::string datagram = i % 2 == 0 ? header() + "TREEROLL" : "";
    for (std::size_t size = random() % 40; size > 0; --size) {
      datagram += static_cast<char>(random());
    }
    EXPECT_EQ(run_filter(program, datagram), 0U) << "datagram " << i;
  }
}

}  // namespace
}  // namespace treeroll::transport
