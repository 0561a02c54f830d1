#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/transport/codec.h"
#include "tests/files/scratch_folder.h"
#include "tests/transport/child_process.h"
#include "tests/transport/loopback.h"
#include "tests/transport/message_maker.h"

// LCM's own programs beside a bus.
namespace treeroll::transport {
namespace {

using protocol::Message;

const char* const kLogger = "/usr/bin/lcm-logger";
const char* const kLogPlayer = "/usr/bin/lcm-logplayer";
constexpr Duration kPatience = std::chrono::seconds(20);

/// The messages of a log in its order; fails on what is not one.
std::vector<Message> read_log(const std::string& path) {
  std::map<std::string, Channel> channels;
  for (const Channel channel : kAllChannels) channels[channel_name(channel)] = channel;
  std::vector<Message> messages;
  lcm::LogFile log(path, "r");
  while (const lcm::LogEvent* event = log.good() ? log.readNextEvent() : nullptr) {
    const auto channel = channels.find(event->channel);
    if (channel == channels.end()) {
      ADD_FAILURE() << "channel " << event->channel;
      continue;
    }
    const auto message = decode(channel->second, {static_cast<const std::byte*>(event->data),
                                                  static_cast<std::size_t>(event->datalen)});
    if (!message) {
      ADD_FAILURE() << message.error().message;
      continue;
    }
    messages.push_back(*message);
  }
  return messages;
}

std::vector<Message> one_of_each(std::uint64_t seed) {
  std::vector<Message> messages;
  for (const Channel channel : kAllChannels) messages.push_back(MessageMaker(seed).make(channel));
  return messages;
}

TEST(LoggerTest, LcmLoggerRecordsEverythingABusPublishes) {
  if (!std::filesystem::exists(kLogger)) GTEST_SKIP() << "needs " << kLogger << " (liblcm-bin)";
  const ScratchFolder folder;
  const std::string path = folder.path() / "run.log";
  const std::string url = loopback_url(101);
  Loop loop;
  Listener bus(loop, url, {});
  ChildProcess logger({kLogger, "--lcm-url=" + url, "--flush-interval=10", "--quiet", path});
  // It listens once it has written something.
  protocol::LearnerStatus probe;
  probe.study = "probe";
  ASSERT_TRUE(run_until(
      loop,
      [&] {
        bus.bus->publish(probe);
        std::error_code error;
        return std::filesystem::file_size(path, error) > 0 && !error;
      },
      kPatience));
  const std::vector<Message> sent = one_of_each(7);
  for (const Message& message : sent) bus.bus->publish(message);
  std::vector<Message> recorded;
  ASSERT_TRUE(run_until(
      loop,
      [&] {
        bus.bus->publish(probe);  // it flushes what it has only when more comes
        recorded = read_log(path);
        std::erase(recorded, Message(probe));
        return recorded.size() >= sent.size();
      },
      kPatience));
  EXPECT_TRUE(logger.is_running());
  EXPECT_EQ(recorded, sent);
}

TEST(LoggerTest, ABusHearsWhatLcmLogplayerPlays) {
  if (!std::filesystem::exists(kLogPlayer)) {
    GTEST_SKIP() << "needs " << kLogPlayer << " (liblcm-bin)";
  }
  const ScratchFolder folder;
  const std::string path = folder.path() / "run.log";
  const std::string url = loopback_url(102);
  Loop loop;
  const std::vector<Message> sent = one_of_each(8);
  {
    Listener writer(loop, "file://" + path + "?mode=w", {});
    for (const Message& message : sent) writer.bus->publish(message);
  }
  ASSERT_EQ(read_log(path), sent);
  Listener listener(loop, url, kEveryChannel);
  const ChildProcess player({kLogPlayer, "--lcm-url=" + url, path});
  EXPECT_TRUE(run_until(
      loop, [&] { return listener.received.size() >= sent.size(); }, kPatience));
  EXPECT_EQ(listener.received, sent);
}

}  // namespace
}  // namespace treeroll::transport
