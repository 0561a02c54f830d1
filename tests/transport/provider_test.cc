#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"
#include "tests/files/scratch_folder.h"
#include "tests/transport/child_process.h"
#include "tests/transport/loopback.h"
#include "tests/transport/message_maker.h"
#include "tests/transport/stalling_tcpq_server.h"

#ifdef __SANITIZE_ADDRESS__
// liblcm's tcpq never frees the names of its subscriptions; the stack of it ends in glib.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libglib-2.0\n";
}
#endif

// The providers that go through liblcm's descriptor.
namespace treeroll::transport {
namespace {

using protocol::Message;
using testing::HasSubstr;

TEST(ProviderTest, MemqBringsEveryMessageBackInOrder) {
  Loop loop;
  Listener bus(loop, "memq://", kEveryChannel);
  std::vector<Message> sent;
  MessageMaker maker(1);
  for (int i = 0; i < 100; ++i) {  // past liblcm's default queue of 30
    for (const Channel channel : kAllChannels) {
      sent.push_back(maker.make(channel));
      bus.bus->publish(sent.back());
    }
  }
  ASSERT_TRUE(run_until(loop, [&] { return bus.received.size() >= sent.size(); }));
  EXPECT_EQ(bus.received, sent);
}

TEST(ProviderTest, MemqReceivesOnlyTheChannelsItAskedFor) {
  Loop loop;
  Listener bus(loop, "memq://", {Channel::kBestPolicy});
  MessageMaker maker(2);
  for (const Channel channel : kAllChannels) bus.bus->publish(maker.make(channel));
  ASSERT_TRUE(run_until(loop, [&] { return !bus.received.empty(); }));
  ASSERT_EQ(bus.received.size(), 1U);
  EXPECT_EQ(channel_of(bus.received[0]), Channel::kBestPolicy);
}

TEST(ProviderTest, ALogThatABusWroteIsReadByAnotherToItsEnd) {
  const ScratchFolder folder;
  const std::string path = folder.path() / "run.log";
  Loop loop;
  std::vector<Message> sent;
  {
    Listener writer(loop, "file://" + path + "?mode=w", {});
    MessageMaker maker(3);
    for (int i = 0; i < 50; ++i) {
      sent.push_back(maker.make(kAllChannels[static_cast<std::size_t>(i) % kAllChannels.size()]));
      writer.bus->publish(sent.back());
    }
    EXPECT_EQ(writer.bus->statistics().num_published, 50);
  }
  Listener reader(loop, "file://" + path + "?speed=0", kEveryChannel);
  ASSERT_TRUE(run_until(loop, [&] { return reader.received.size() >= sent.size(); }));
  EXPECT_EQ(reader.received, sent);
  // At its end there is nothing to wait for: the loop must not spin on the descriptor.
  const std::clock_t before = std::clock();
  run_until(
      loop, [] { return false; }, std::chrono::milliseconds(200));
  EXPECT_LT(std::clock() - before, CLOCKS_PER_SEC / 10) << "processor time of 0.2 s of idling";
}

TEST(ProviderTest, ALogThatIsNotThereIsSaidSo) {
  Loop loop;
  const auto bus = open_bus(loop, {"file:///nowhere/run.log", {}, {}});
  ASSERT_FALSE(bus);
  EXPECT_THAT(bus.error().message, HasSubstr("LCM URL \"file:///nowhere/run.log\": "));
  EXPECT_THAT(bus.error().message, HasSubstr("log"));
}

TEST(ProviderTest, NoTcpqServerIsSaidSo) {
  Loop loop;
  const auto bus = open_bus(loop, {"tcpq://127.0.0.1:1", {}, {}});
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().message,
            "LCM URL \"tcpq://127.0.0.1:1\": no tcpq server at 127.0.0.1:1: Connection refused");
}

/// A server of another kind: takes connections and says nothing, or something else.
TEST(ProviderTest, WhatIsNoTcpqServerIsNotWaitedForForever) {
  Loop loop;
  const SilentServer server;
  const std::string url = "tcpq://127.0.0.1:" + std::to_string(server.port());
  const auto bus = open_bus(loop, {url, {}, {}});
  ASSERT_FALSE(bus);
  EXPECT_THAT(bus.error().message, HasSubstr("no answer within a second"));
}

/// Shakes hands with whoever comes, says the head of a message and then nothing more.
TEST(ProviderTest, ATcpqServerThatStopsAmidAMessageCostsTheConnectionNotTheDaemon) {
  const StallingTcpqServer server;
  Loop loop;
  const auto bus = open_bus(loop, {server.url(), {Channel::kRewardBatch}, [](const Message&) {}});
  ASSERT_TRUE(bus) << bus.error().message;
  ASSERT_TRUE(run_until(
      loop, [&] { return server.num_connections() >= 4; }, std::chrono::seconds(30)))
      << "it probes and connects, and after the half message both again";
}

/// Of this process, to a server on this port.
std::vector<int> connections_to(int port) {
  std::vector<int> found;
  for (int descriptor = 0; descriptor < 1024; ++descriptor) {
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    if (getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &size) != 0) continue;
    if (peer.sin_family == AF_INET && ntohs(peer.sin_port) == port) found.push_back(descriptor);
  }
  return found;
}

TEST(ProviderTest, ATcpqMessageLeavesWholeAndAtOnce) {
  const StallingTcpqServer server;
  Loop loop;
  Listener bus(loop, server.url(), {});
  MessageMaker maker(5);
  bus.bus->publish(maker.make(Channel::kLearnerStatus));
  const std::vector<int> connections =
      connections_to(std::stoi(server.url().substr(server.url().rfind(':') + 1)));
  ASSERT_EQ(connections.size(), 1U);
  const auto flag = [&](int name) {
    int value = -1;
    socklen_t size = sizeof value;
    EXPECT_EQ(getsockopt(connections[0], IPPROTO_TCP, name, &value, &size), 0);
    return value;
  };
  EXPECT_EQ(flag(TCP_NODELAY), 1) << "nothing waits for the acknowledgement of what is before it";
  EXPECT_EQ(flag(TCP_CORK), 0) << "nor for more to go along with";
}

const char* const kLcmJar = "/usr/share/java/lcm.jar";

/// LCM's hub, in Java, and its address.
class Hub {
 public:
  static bool is_there() {
    return std::filesystem::exists(kLcmJar) && std::filesystem::exists("/usr/bin/java");
  }
  void start() { server_ = std::make_unique<ChildProcess>(command_); }
  void stop() { server_.reset(); }
  bool answers(Loop& loop, Duration patience) const {
    return run_until(
        loop,
        [&] {
          return bool(open_bus(loop, {url, {}, {}}));
        },
        patience);
  }

  const std::string port = std::to_string(free_tcp_port());
  const std::string url = "tcpq://127.0.0.1:" + port;

 private:
  const std::vector<std::string> command_ = {"/usr/bin/java", "-cp", kLcmJar, "lcm.lcm.TCPService",
                                             port};
  std::unique_ptr<ChildProcess> server_;
};

TEST(ProviderTest, TcpqExchangesMessagesAndOutlivesItsServer) {
  if (!Hub::is_there()) GTEST_SKIP() << "needs Java and " << kLcmJar << " (liblcm-java)";
  Loop loop;
  const Duration patience = std::chrono::seconds(30);
  Hub hub;
  hub.start();
  ASSERT_TRUE(hub.answers(loop, patience));
  Listener learner(loop, hub.url, kEveryChannel);
  Listener worker(loop, hub.url, kEveryChannel);
  EXPECT_EQ(learner.bus->batch_bytes_max(), protocol::kBatchBytesLocalMax);
  const Message first = MessageMaker(1).make(Channel::kRolloutBatch);
  // The server takes subscriptions in its own time.
  const auto exchange = [&](const Message& message) {
    return run_until(
        loop,
        [&] {
          learner.bus->publish(message);
          return !worker.received.empty() && worker.received.back() == message;
        },
        patience);
  };
  ASSERT_TRUE(exchange(first));

  hub.stop();
  ASSERT_TRUE(run_until(
      loop,
      [&] {
        learner.bus->publish(first);
        return learner.bus->statistics().num_unsent > 0;
      },
      patience));
  EXPECT_THAT(learner.bus->statistics().last_publish_error, HasSubstr("TREEROLL_ROLLOUTS: "));

  hub.start();
  EXPECT_TRUE(exchange(MessageMaker(2).make(Channel::kRolloutBatch)));
}

/// The hub writes a message in parts, and Nagle's algorithm holds each back until the one before is
/// acknowledged. The kernel puts that off by 40 ms, to send it along with an answer.
TEST(ProviderTest, NoTcpqMessageWaitsForADelayedAcknowledgement) {
  if (!Hub::is_there()) GTEST_SKIP() << "needs Java and " << kLcmJar << " (liblcm-java)";
  constexpr Duration kDelay = std::chrono::milliseconds(40);
  Loop loop;
  const Duration patience = std::chrono::seconds(30);
  Hub hub;
  hub.start();
  ASSERT_TRUE(hub.answers(loop, patience));
  Listener learner(loop, hub.url, {Channel::kRewardBatch});
  Listener worker(loop, hub.url, {Channel::kRolloutBatch});
  const Message question = MessageMaker(1).make(Channel::kRolloutBatch);
  const Message answer = MessageMaker(2).make(Channel::kRewardBatch);
  // Again and again until the hub has taken the subscriptions.
  ASSERT_TRUE(run_until(
      loop,
      [&] {
        learner.bus->publish(question);
        worker.bus->publish(answer);
        return !worker.received.empty() && !learner.received.empty();
      },
      patience));
  std::vector<Duration> times;
  for (int i = 0; i < 60; ++i) {
    const std::size_t num_questions = worker.received.size();
    const std::size_t num_answers = learner.received.size();
    const TimePoint start = loop.now();
    learner.bus->publish(question);
    ASSERT_TRUE(run_until(
        loop, [&] { return worker.received.size() > num_questions; }, patience));
    worker.bus->publish(answer);
    ASSERT_TRUE(run_until(
        loop, [&] { return learner.received.size() > num_answers; }, patience));
    times.push_back(loop.now() - start);
  }
  std::ranges::sort(times);
  EXPECT_LT(times[times.size() / 2], kDelay) << "of most, on a machine however busy";
}

}  // namespace
}  // namespace treeroll::transport
