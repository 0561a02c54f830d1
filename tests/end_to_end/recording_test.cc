// Everything that happens is on the bus: lcm-logger sees it, and its log can be read back.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <map>
#include <memory>
#include <set>
#include <thread>

#include "common/transport/codec.h"
#include "tests/end_to_end/lcm_log.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

using std::chrono::seconds;
using transport::Channel;

std::vector<protocol::Message> read_log(const std::filesystem::path& path) {
  std::vector<protocol::Message> messages;
  for (const Told& event : events_of(path)) {
    const std::optional<Channel> channel = channel_named(event.channel);
    if (!channel) continue;
    Result<protocol::Message> message = transport::decode(*channel, event.bytes);
    EXPECT_TRUE(message) << event.channel << ": " << message.error().message;
    if (message) messages.push_back(std::move(*message));
  }
  return messages;
}

std::string recorded_study() { return two_runs("recorded", 20'000); }

TEST(RecordingTest, ALoggerSeesEveryRolloutRewardDefinitionAndStatus) {
  const Service service;
  const std::filesystem::path log = service.directory() / "run.lcmlog";
  Daemon logger("/usr/bin/lcm-logger", {"--quiet", "--lcm-url=" + service.url(), log.string()},
                service.directory());
  std::filesystem::path study = service.study(recorded_study());
  ASSERT_TRUE(eventually(seconds(10), [&] { return std::filesystem::exists(log); }));
  const Service::Learnt learnt = service.learn(study, {"--local-workers", "2"});
  ASSERT_EQ(learnt.status, 0) << learnt.log;
  logger.kill(SIGINT);
  ASSERT_NE(logger.wait(seconds(10)), -1);

  std::map<std::size_t, int> count;  // by place in the variant
  std::set<protocol::RolloutKey> asked;
  std::map<protocol::RolloutKey, double> answered;
  std::set<int> improved;
  std::set<ContentHash> policies;
  for (const protocol::Message& message : read_log(log)) {
    ++count[message.index()];
    if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
      for (const auto& rollout : batch->rollouts) asked.insert(rollout.key);
    } else if (const auto* rewards = std::get_if<protocol::RewardBatch>(&message)) {
      for (const auto& result : rewards->results) answered[result.key] = result.outcome.reward();
    } else if (const auto* piece = std::get_if<protocol::DefinitionPiece>(&message)) {
      if (piece->name.kind == protocol::DefinitionKind::kPolicy) policies.insert(piece->name.id);
    } else if (const auto* best = std::get_if<protocol::BestPolicy>(&message)) {
      improved.insert(best->run);
    }
  }
  EXPECT_EQ(asked.size(), kAskedOfTwoRuns);
  EXPECT_EQ(answered.size(), kAskedOfTwoRuns);
  EXPECT_EQ(improved, (std::set<int>{0, 1}));
  EXPECT_GE(policies.size(), 3U);  // switches
  for (const protocol::Message& expected :
       {protocol::Message(protocol::DefinitionPiece{}), protocol::Message(protocol::WorkerStatus{}),
        protocol::Message(protocol::DefinitionReport{}),
        protocol::Message(protocol::LearnerStatus{}), protocol::Message(protocol::RunStatus{})}) {
    EXPECT_GT(count[expected.index()], 0)
        << transport::channel_name(transport::channel_of(expected));
  }
}

/// Plays a log into the group, over and over, while the learner works.
void play_until_ended(const Service& service, const std::filesystem::path& log, int speed,
                      const std::filesystem::path& end) {
  ASSERT_TRUE(eventually(seconds(60), [&] {
    Daemon player("/usr/bin/lcm-logplayer",
                  {fmt::format("--speed={}", speed), "--lcm-url=" + service.url(), log.string()},
                  service.directory());
    while (player.wait(seconds(0)) == -1 && !std::filesystem::exists(end)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return std::filesystem::exists(end);
  }));
}

TEST(RecordingTest, ALogThatIsPlayedIntoTheGroupChangesNothing) {
  const Service service;
  const auto worker = [&service] {
    return std::make_unique<Daemon>(
        "treeroll-worker", std::vector<std::string>{"--processes", "2", "--lcm-url", service.url()},
        service.directory());
  };
  const std::filesystem::path log = service.directory() / "run.lcmlog";
  const auto stays = worker();
  auto leaves = worker();
  auto logger = std::make_unique<Daemon>(
      "/usr/bin/lcm-logger",
      std::vector<std::string>{"--quiet", "--lcm-url=" + service.url(), log.string()},
      service.directory());
  ASSERT_TRUE(eventually(seconds(10), [&] { return std::filesystem::exists(log); }));
  ASSERT_EQ(service.learn(service.study(recorded_study()), {}).status, 0);
  logger->kill(SIGINT);
  ASSERT_NE(logger->wait(seconds(10)), -1);
  leaves->kill(SIGTERM);
  ASSERT_EQ(leaves->wait(seconds(20)), 0);
  leaves.reset();

  std::string longer = recorded_study();
  longer.replace(longer.find("rollouts = 60"), 13, "rollouts = 160");
  const std::filesystem::path study = service.study(longer);
  std::map<int, Service::Learnt> learnt;  // by speed; 0: undisturbed
  std::map<int, double> time_s;
  for (const int speed : {0, 1, 10}) {
    const std::string name = fmt::format("at_speed_{}", speed);
    const std::filesystem::path state = service.directory() / name;
    const auto start = std::chrono::steady_clock::now();
    Daemon learner(
        "treeroll-learner",
        {study.string(), "--json", "--lcm-url", service.url(), "--state-dir", state.string()},
        service.directory());
    if (speed > 0) play_until_ended(service, log, speed, state / "runs.csv");
    learnt[speed] = service.learnt(learner, name, seconds(100));
    ASSERT_EQ(learnt[speed].status, 0) << learnt[speed].log;
    time_s[speed] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("  speed %2d: %.2f s\n", speed, time_s[speed]);
    EXPECT_EQ(learnt[speed].rollouts_csv, learnt[0].rollouts_csv);
    EXPECT_EQ(learnt[speed].runs_csv, learnt[0].runs_csv);
    // Once it was as long as the playback. One lease that runs out on a busy machine is not that.
    EXPECT_LE(time_s[speed], 2 * time_s[0] + 4) << learnt[speed].log;
    EXPECT_THAT(learnt[speed].log, testing::Not(testing::HasSubstr("2 workers")));
  }
}

}  // namespace
}  // namespace treeroll::end_to_end
