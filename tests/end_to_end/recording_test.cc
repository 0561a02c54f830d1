// Everything that happens is on the bus: lcm-logger sees it, and its log can be read back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <set>

#include "common/transport/codec.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::seconds;
using transport::Channel;

constexpr const char* kStudy = R"(
[study]
name = "recorded"
repetitions = 2
rollouts = 60
[task]
name = "synthetic"
mode = "sleep"
duration_us = 20000
[policy]
model = "tree"
components = [1, 2]
[exploration]
noise_variance = [0.01, 0.1, 0.01]
convergence_window = 10
first_update = 5
convergence_slope = 1
[[conditions]]
name = "tree"
)";

std::vector<protocol::Message> read_log(const std::filesystem::path& path) {
  const std::map<std::string, Channel> channels = [] {
    std::map<std::string, Channel> by_name;
    for (int i = 0; i < transport::kNumChannels; ++i) {
      by_name[transport::channel_name(static_cast<Channel>(i))] = static_cast<Channel>(i);
    }
    return by_name;
  }();
  std::vector<protocol::Message> messages;
  lcm::LogFile log(path.string(), "r");
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    const auto channel = channels.find(event->channel);
    if (channel == channels.end()) continue;
    const auto* bytes = static_cast<const std::byte*>(event->data);
    Result<protocol::Message> message =
        transport::decode(channel->second, {bytes, static_cast<std::size_t>(event->datalen)});
    EXPECT_TRUE(message) << event->channel << ": " << message.error().message;
    if (message) messages.push_back(std::move(*message));
  }
  return messages;
}

TEST(RecordingTest, ALoggerSeesEveryRolloutRewardDefinitionAndStatus) {
  const Service service;
  const std::filesystem::path log = service.directory() / "run.lcmlog";
  Daemon logger("/usr/bin/lcm-logger", {"--quiet", "--lcm-url=" + service.url(), log.string()},
                service.directory());
  std::filesystem::path study = service.study(kStudy);
  ASSERT_TRUE(eventually(seconds(10), [&] { return std::filesystem::exists(log); }));
  const Service::Learnt learnt = service.learn(study, {"--local-workers", "2"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  logger.kill(SIGINT);
  ASSERT_NE(logger.wait(seconds(10)), -1);

  std::map<std::size_t, int> count;  // by place in the variant
  std::set<protocol::RolloutKey> asked;
  std::map<protocol::RolloutKey, double> answered;
  std::set<int> improved;
  for (const protocol::Message& message : read_log(log)) {
    ++count[message.index()];
    if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
      for (const auto& rollout : batch->rollouts) asked.insert(rollout.key);
    } else if (const auto* rewards = std::get_if<protocol::RewardBatch>(&message)) {
      for (const auto& result : rewards->results) answered[result.key] = result.outcome.reward();
    } else if (const auto* best = std::get_if<protocol::BestPolicy>(&message)) {
      improved.insert(best->run);
    }
  }
  const std::size_t all = 2 * 60 + 4;  // and two evaluations of each run
  EXPECT_EQ(asked.size(), all);
  EXPECT_EQ(answered.size(), all);
  EXPECT_EQ(improved, (std::set<int>{0, 1}));
  EXPECT_GE((count[protocol::Message(protocol::PolicyDefinition{}).index()]), 3);  // switches
  for (const protocol::Message& expected :
       {protocol::Message(protocol::TaskDefinition{}), protocol::Message(protocol::WorkerStatus{}),
        protocol::Message(protocol::DefinitionReport{}),
        protocol::Message(protocol::LearnerStatus{}), protocol::Message(protocol::RunStatus{})}) {
    EXPECT_GT(count[expected.index()], 0)
        << transport::channel_name(transport::channel_of(expected));
  }
}

}  // namespace
}  // namespace treeroll::end_to_end
