#include "common/transport/bus.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"
#include "common/transport/lcm_url.h"
#include "tests/transport/loopback.h"
#include "tests/transport/message_maker.h"

// These tests open sockets on this host: multicast with ttl=0.
namespace treeroll::transport {
namespace {

using protocol::Message;
using testing::HasSubstr;

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(BusTest, TwoBusesExchangeEveryMessageInOrder) {
  Loop loop;
  const std::string url = loopback_url(1);
  Listener learner(loop, url, kEveryChannel);
  Listener worker(loop, url, kEveryChannel);
  std::vector<Message> sent;
  MessageMaker maker(1);
  for (int i = 0; i < 10; ++i) {
    for (const Channel channel : kAllChannels) {
      sent.push_back(maker.make(channel));
      (i % 2 == 0 ? learner : worker).bus->publish(sent.back());
    }
  }
  ASSERT_TRUE(run_until(loop,
                        [&] {
                          return learner.received.size() >= sent.size() &&
                                 worker.received.size() >= sent.size();
                        }))
      << learner.received.size() << " and " << worker.received.size() << " of " << sent.size();
  EXPECT_EQ(learner.received, sent);
  EXPECT_EQ(worker.received, sent);
  EXPECT_EQ(learner.bus->statistics().num_published, 5 * kNumChannels);
  EXPECT_EQ(worker.bus->statistics().num_received, 10 * kNumChannels);
  EXPECT_EQ(worker.bus->statistics().num_rejected, 0);
  EXPECT_EQ(worker.bus->statistics().num_foreign, 0);
}

TEST(BusTest, ReceivesOnlyTheChannelsItAskedFor) {
  Loop loop;
  const std::string url = loopback_url(2);
  Listener everything(loop, url, kEveryChannel);
  std::vector<std::unique_ptr<Listener>> listeners;
  for (const Channel channel : kAllChannels) {
    listeners.push_back(std::make_unique<Listener>(loop, url, std::vector<Channel>{channel}));
  }
  MessageMaker maker(2);
  std::vector<Message> sent;
  for (const Channel channel : kAllChannels) {
    sent.push_back(maker.make(channel));
    everything.bus->publish(sent.back());
  }
  ASSERT_TRUE(run_until(loop, [&] {
    std::size_t num_received = everything.received.size();
    for (const auto& listener : listeners) num_received += listener->received.size();
    return num_received >= 2 * kAllChannels.size();
  }));
  for (std::size_t i = 0; i < kAllChannels.size(); ++i) {
    EXPECT_EQ(listeners[i]->received, std::vector<Message>{sent[i]});
    EXPECT_EQ(listeners[i]->bus->statistics().num_foreign, 0) << "the kernel's filter let it by";
  }
}

TEST(BusTest, GarbageOnTheGroupIsCountedOrFilteredAndHarmsNothing) {
  Loop loop;
  const std::string url = loopback_url(3);
  Listener listener(loop, url, kEveryChannel);
  Listener sender(loop, url, {});
  const std::string truth = text_of(encode(protocol::RunStatus{}));
  std::int64_t num_refused = 0;
  const auto refused = [&](const std::string& datagram) {
    send_datagram(url, datagram);
    ++num_refused;
  };
  // Past the kernel's filter, to the codec.
  refused(short_message("TREEROLL_RUNS", truth.substr(0, 40)));
  refused(short_message("TREEROLL_RUNS", truth + "x"));
  refused(short_message("TREEROLL_BEST", truth));
  // 36 bytes that claim two billion roll-outs.
  const std::string batch = text_of(encode(protocol::RolloutBatch{}));
  refused(short_message("TREEROLL_ROLLOUTS",
                        batch.substr(0, 24) + "\x7f\xff\xff\xff" + std::string(8, '\0')));
  // Not past the filter.
  send_datagram(url, "");
  send_datagram(url, "LC02\1\1\1\1x");  // nine bytes without a NUL
  send_datagram(url, std::string(60000, 'x'));
  send_datagram(url, short_message("TREEROLL_RUN", truth));
  send_datagram(url, short_message("TREEROLL_RUNSX", truth));
  send_datagram(url, short_message("SOMETHING_ELSE", truth));
  send_datagram(url, short_message(std::string(100, 'c'), truth));
  std::string fragment = short_message("TREEROLL_RUNS", truth);
  fragment[3] = '3';
  send_datagram(url, fragment);
  const Message last = MessageMaker(3).make(Channel::kBestPolicy);
  sender.bus->publish(last);
  ASSERT_TRUE(run_until(loop, [&] { return !listener.received.empty(); }));
  EXPECT_EQ(listener.received, std::vector<Message>{last});
  const BusStatistics statistics = listener.bus->statistics();
  EXPECT_EQ(statistics.num_rejected, num_refused);
  EXPECT_EQ(statistics.num_foreign, 0);
  EXPECT_EQ(statistics.last_rejection,
            "rollout_batch.rollouts: count 2147483647 is not within 0..1024");
}

TEST(BusTest, AnotherGroupOnTheSamePortIsNotHeard) {
  Loop loop;
  Listener listener(loop, loopback_url(4), kEveryChannel);
  Listener neighbour(loop, loopback_url(5), kEveryChannel);
  const Message theirs = MessageMaker(4).make(Channel::kRunStatus);
  const Message ours = MessageMaker(5).make(Channel::kRunStatus);
  neighbour.bus->publish(theirs);
  listener.bus->publish(ours);
  ASSERT_TRUE(
      run_until(loop, [&] { return !listener.received.empty() && !neighbour.received.empty(); }));
  EXPECT_EQ(listener.received, std::vector<Message>{ours});
  EXPECT_EQ(neighbour.received, std::vector<Message>{theirs});
}

TEST(BusTest, ABurstOfFullBatchesIsReceivedWhole) {
  Loop loop;
  const std::string url = loopback_url(6);
  Listener listener(loop, url, {Channel::kRolloutBatch});
  Listener sender(loop, url, {});
  protocol::RolloutBatch batch;
  batch.rollouts.assign(1, {});
  batch.rollouts[0].theta.assign(protocol::kThetaDimMax, 0.5);
  // 32 kB each; half of what the kernel granted.
  const int num_batches = listener.bus->statistics().receive_buffer_bytes / 2 / 33000;
  ASSERT_GT(num_batches, 0);
  for (batch.sequence = 1; batch.sequence <= num_batches; ++batch.sequence) {
    sender.bus->publish(batch);
  }
  run_until(loop, [&] { return listener.received.size() >= std::size_t(num_batches); });
  ASSERT_EQ(listener.received.size(), std::size_t(num_batches));
  for (int i = 0; i < num_batches; ++i) {
    EXPECT_EQ(std::get<protocol::RolloutBatch>(listener.received[std::size_t(i)]).sequence, i + 1);
  }
}

TEST(BusTest, OthersHaveTheirTurnWhileMoreIsWaitingThanATurnReads) {
  Loop loop;
  const std::string url = loopback_url(6);
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const int num_messages = 3 * protocol::kDatagramsPerTurnMax;
  int num_received = 0;
  BusOptions options;
  options.url = url;
  options.channels = {Channel::kRolloutBatch};
  options.on_message = [&](const Message&) {
    if (++num_received == 1) {
      EXPECT_EQ(write(ends[1], "x", 1), 1);
    }
  };
  const auto bus = open_bus(loop, options);
  ASSERT_TRUE(bus);
  for (int i = 0; i < num_messages; ++i) (*bus)->publish(protocol::RolloutBatch{});
  int num_received_by_then = 0;
  loop.watch(ends[0], [&] {
    num_received_by_then = num_received;
    loop.forget(ends[0]);
  });
  ASSERT_TRUE(run_until(loop, [&] { return num_received == num_messages; }));
  EXPECT_GT(num_received_by_then, 0);
  EXPECT_LE(num_received_by_then, 2 * protocol::kDatagramsPerTurnMax);
  close(ends[0]);
  close(ends[1]);
}

TEST(BusTest, WhatAReceiverWouldRefuseIsNotSentAndSaidSo) {
  Loop loop;
  const std::string url = loopback_url(7);
  Listener bus(loop, url, kEveryChannel);
  protocol::RewardBatch too_large;
  const Outcome failed = Outcome::failed(RolloutStatus::kFailed, std::string(40, 'x'));
  too_large.results.assign(1024, {.key = {1, 2}, .outcome = failed});
  bus.bus->publish(too_large);
  EXPECT_EQ(bus.bus->statistics().num_unsent, 1);
  EXPECT_THAT(bus.bus->statistics().last_publish_error,
              HasSubstr("TREEROLL_REWARDS: reward_batch: "));
  EXPECT_THAT(bus.bus->statistics().last_publish_error, HasSubstr("more than 65000"));
  protocol::RunStatus not_finite;
  not_finite.mean_reward = std::nan("");
  bus.bus->publish(not_finite);
  EXPECT_EQ(bus.bus->statistics().num_unsent, 2);
  EXPECT_EQ(bus.bus->statistics().last_publish_error,
            "TREEROLL_RUNS: run_status.mean_reward: nan is not a finite number");
  EXPECT_EQ(bus.bus->statistics().num_published, 0);
}

TEST(BusTest, TheLargestMessageOfALimitedSizeGoesThrough) {
  Loop loop;
  const std::string url = loopback_url(8);
  Listener bus(loop, url, kEveryChannel);
  protocol::RewardBatch batch;
  const Outcome failed = Outcome::failed(RolloutStatus::kFailed, std::string(21, 'x'));
  batch.results.assign(1024, {.key = {1, 2}, .outcome = failed});
  bus.bus->publish(batch);
  ASSERT_TRUE(run_until(loop, [&] { return !bus.received.empty(); }))
      << bus.bus->statistics().last_publish_error;
  EXPECT_EQ(bus.received, std::vector<Message>{batch});
}

TEST(BusTest, TheReceiveBufferIsWhatTheUrlAsksFor) {
  Loop loop;
  Listener bus(loop, loopback_url(9, "&recv_buf_size=65536"), kEveryChannel);
  EXPECT_EQ(bus.bus->statistics().receive_buffer_bytes, 65536);
}

TEST(BusTest, BatchesFitAFrameWhereDatagramsMayLeaveThisHost) {
  Loop loop;
  Listener local(loop, loopback_url(10), {});
  EXPECT_EQ(local.bus->batch_bytes_max(), protocol::kBatchBytesLocalMax);
  std::string url = loopback_url(11);
  url.replace(url.find("ttl=0"), 5, "ttl=1");
  Listener remote(loop, url, {});
  EXPECT_EQ(remote.bus->batch_bytes_max(), protocol::kBatchBytesRemoteMax);
}

TEST(BusTest, WhatNoFrameHoldsIsNotSentWhereDatagramsMayLeaveThisHost) {
  Loop loop;
  std::string url = loopback_url(13);
  url.replace(url.find("ttl=0"), 5, "ttl=1");
  Listener bus(loop, url, {});
  protocol::RolloutBatch batch;
  batch.rollouts.resize(1);
  batch.rollouts[0].theta.assign(150, .5);
  bus.bus->publish(batch);
  EXPECT_EQ(bus.bus->statistics().num_published, 1);
  batch.rollouts[0].theta.assign(160, .5);
  bus.bus->publish(batch);
  EXPECT_EQ(bus.bus->statistics().num_unsent, 1);
  EXPECT_THAT(bus.bus->statistics().last_publish_error,
              HasSubstr("TREEROLL_ROLLOUTS: 1450 bytes are more than one frame holds, 1400"));
}

TEST(BusTest, AProgramThatMeetsOthersRefusesAUrlThatReachesNone) {
  Loop loop;
  for (const std::string url : {"memq://", "file:///tmp/run.log?mode=w"}) {
    BusOptions options;
    options.url = url;
    options.among_programs = true;
    const auto bus = open_bus(loop, std::move(options));
    ASSERT_FALSE(bus) << url;
    EXPECT_THAT(bus.error().message,
                HasSubstr("LCM URL \"" + url + "\": reaches no other program"));
  }
}

TEST(BusTest, AUrlWithoutAPortSends) {
  Loop loop;
  Listener bus(loop, "udpm://239.255.76.67?ttl=0", {});
  bus.bus->publish(protocol::RolloutBatch{});
  EXPECT_EQ(bus.bus->statistics().num_published, 1) << bus.bus->statistics().last_publish_error;
}

TEST(BusTest, ABusMayBeClosedAndOpenedAgain) {
  Loop loop;
  const std::string url = loopback_url(12);
  for (int i = 0; i < 20; ++i) {
    Listener bus(loop, url, kEveryChannel);
    const Message message = MessageMaker(static_cast<std::uint64_t>(i)).make(Channel::kRunStatus);
    bus.bus->publish(message);
    ASSERT_TRUE(run_until(loop, [&] { return !bus.received.empty(); }));
    EXPECT_EQ(bus.received, std::vector<Message>{message});
  }
}

TEST(BusTest, ABadUrlOpensNothing) {
  Loop loop;
  const auto bus = open_bus(loop, {"udpm://239.255.76.67:7667?ttl=many", {}, {}});
  ASSERT_FALSE(bus);
  EXPECT_EQ(bus.error().message,
            "LCM URL \"udpm://239.255.76.67:7667?ttl=many\": ttl \"many\" must be a whole number "
            "within 0..255");
}

TEST(BusTest, AnAddressInUseIsSaidSo) {
  Loop loop;
  const std::string url = loopback_url(13);
  const auto parsed = parse_lcm_url(url);
  // Another program that does not share the address.
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(parsed->port);
  inet_pton(AF_INET, parsed->host.c_str(), &address.sin_addr);
  ASSERT_EQ(bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const auto bus = open_bus(loop, {url, {}, {}});
  close(descriptor);
  ASSERT_FALSE(bus);
  EXPECT_THAT(bus.error().message, HasSubstr("cannot listen on 239.255.77.13:"));
  EXPECT_THAT(bus.error().message, HasSubstr("Address already in use"));
}

}  // namespace
}  // namespace treeroll::transport
