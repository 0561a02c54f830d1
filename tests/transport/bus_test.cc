#include "common/transport/bus.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>

#include "common/protocol/limits.h"
#include "common/transport/codec.h"
#include "tests/transport/loopback.h"
#include "tests/transport/message_maker.h"

// These tests open sockets on this host: multicast with ttl=0.
namespace treeroll::transport {
namespace {

using protocol::Message;
using testing::HasSubstr;

const std::vector<Channel> kAll(kAllChannels.begin(), kAllChannels.end());

TEST(BusTest, TwoBusesExchangeEveryMessageInOrder) {
  Loop loop;
  const std::string url = loopback_url(1);
  Listener learner(loop, url, kAll);
  Listener worker(loop, url, kAll);
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
  EXPECT_EQ(learner.bus->statistics().num_published, 50);
  EXPECT_EQ(worker.bus->statistics().num_received, 100);
  EXPECT_EQ(worker.bus->statistics().num_rejected, 0);
  EXPECT_EQ(worker.bus->statistics().num_foreign, 0);
}

TEST(BusTest, ReceivesOnlyTheChannelsItAskedFor) {
  Loop loop;
  const std::string url = loopback_url(2);
  Listener everything(loop, url, kAll);
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

}  // namespace
}  // namespace treeroll::transport
