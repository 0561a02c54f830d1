// A journal as LCM messages: lcm-logplayer plays it, everybody can read it, and no worker takes it
// for work.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <optional>
#include <set>

#include "common/transport/codec.h"
#include "learner/journal/journal_fold.h"
#include "tests/end_to_end/lcm_log.h"
#include "tests/end_to_end/service.h"

namespace treeroll::end_to_end {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::HasSubstr;
using transport::Channel;

constexpr std::string_view kReplayed = "REPLAYED_";

/// Precondition: the channel is that of a message that was exported.
protocol::Message message_of(const Told& event) {
  EXPECT_TRUE(event.channel.starts_with(kReplayed)) << event.channel;
  const auto channel = channel_named(std::string_view(event.channel).substr(kReplayed.size()));
  if (!channel) {
    ADD_FAILURE() << event.channel;
    return {};
  }
  Result<protocol::Message> message = transport::decode(*channel, event.bytes);
  EXPECT_TRUE(message) << event.channel << ": " << message.error().message;
  return message ? *message : protocol::Message{};
}

template <class M>
std::vector<M> all_of_type(const std::vector<Told>& events) {
  std::vector<M> found;
  for (const Told& event : events) {
    const protocol::Message message = message_of(event);
    if (const auto* wanted = std::get_if<M>(&message)) found.push_back(*wanted);
  }
  return found;
}

/// A subscriber with liblcm alone.
class Hearer {
 public:
  Hearer(const std::string& url, const std::string& channels)
      : lcm_(url + "&recv_buf_size=4194304") {
    lcm_.subscribe(channels, &Hearer::take, this)->setQueueCapacity(0);
  }
  /// What comes until `enough` holds.
  bool hear(seconds limit, const std::function<bool()>& enough) {
    return eventually(limit, [&] {
      while (lcm_.handleTimeout(0) > 0) continue;
      return enough();
    });
  }
  const std::vector<Told>& heard() const { return heard_; }

 private:
  void take(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    const auto* bytes = static_cast<const std::byte*>(buffer->data);
    heard_.push_back({buffer->recv_utime, channel, {bytes, bytes + buffer->data_size}});
  }

  lcm::LCM lcm_;
  std::vector<Told> heard_;
};

class PlayedJournalTest : public ::testing::Test {
 protected:
  /// Learns the study with a worker that stays, and exports it.
  void SetUp() override {
    Daemon learner("treeroll-learner",
                   {service_.study(two_runs("played", 2000)).string(), "--lcm-url", service_.url(),
                    "--state-dir", journal_.parent_path().string()},
                   service_.directory());
    ASSERT_EQ(learner.wait(seconds(60)), 0) << learner.standard_error();
    const Said said = service_.run("treeroll-replay", {journal_.parent_path().string(), "--export",
                                                       "lcm", "--output", log_.string()});
    ASSERT_EQ(said.status, 0) << said.errors;
  }

  void play(const fs::path& log) {
    Daemon player("/usr/bin/lcm-logplayer", {"--lcm-url=" + service_.url(), log.string()},
                  service_.directory());
    ASSERT_EQ(player.wait(seconds(60)), 0) << player.standard_error();
  }
  /// A log that asks workers for what the exported one tells of, as a learner that is at work.
  fs::path as_of_a_learner_at_work(std::string_view prefix) {
    fs::path path = service_.directory() / (std::string(prefix) + "work.lcmlog");
    lcm::LogFile log(path.string(), "w");
    std::int64_t number = 0;
    for (const Told& event : events_of(log_)) {
      protocol::Message message = message_of(event);
      // Nobody has answered this one before.
      if (auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
        ++batch->learner_id;
      } else if (auto* piece = std::get_if<protocol::DefinitionPiece>(&message)) {
        ++piece->learner_id;
      } else {
        continue;
      }
      std::vector<std::byte> bytes = transport::encode(message);
      lcm::LogEvent rewritten;
      rewritten.eventnum = number++;
      rewritten.timestamp = event.time_us;
      rewritten.channel =
          std::string(prefix) + transport::channel_name(transport::channel_of(message));
      rewritten.datalen = static_cast<std::int32_t>(bytes.size());
      rewritten.data = bytes.data();
      EXPECT_EQ(log.writeEvent(&rewritten), 0);
    }
    return path;
  }

  Service service_;
  Daemon worker_{
      "treeroll-worker", {"--processes", "2", "--lcm-url", service_.url()}, service_.directory()};
  fs::path journal_ = service_.directory() / "state" / "journal.lcmlog";
  fs::path log_ = service_.directory() / "exported.lcmlog";
};

TEST_F(PlayedJournalTest, TellsAllThatTheJournalKnowsInOurTypes) {
  const std::vector<Told> events = events_of(log_);
  std::map<protocol::RolloutKey, double> rewards;
  for (const auto& batch : all_of_type<protocol::RewardBatch>(events)) {
    for (const auto& result : batch.results) rewards[result.key] = result.outcome.reward();
  }
  EXPECT_EQ(rewards.size(), kAskedOfTwoRuns);
  std::set<ContentHash> asked_of;
  std::set<protocol::RolloutKey> asked;
  for (const auto& batch : all_of_type<protocol::RolloutBatch>(events)) {
    for (const auto& request : batch.rollouts) {
      asked.insert(request.key);
      asked_of.insert(request.policy_id);
      asked_of.insert(request.task_id);
      EXPECT_FALSE(request.theta.empty());
    }
  }
  EXPECT_EQ(asked.size(), kAskedOfTwoRuns);
  std::set<ContentHash> defined;
  for (const auto& piece : all_of_type<protocol::DefinitionPiece>(events)) {
    if (piece.index == 0) defined.insert(piece.name.id);
  }
  EXPECT_EQ(defined, asked_of);

  std::map<std::pair<int, int>, double> last_rewards;  // by run and roll-outs applied
  std::map<int, protocol::RunStatus> runs;
  for (const auto& status : all_of_type<protocol::RunStatus>(events)) {
    last_rewards[{status.run, status.num_applied}] = status.last_reward;
    runs[status.run] = status;
  }
  EXPECT_GE(last_rewards.size(), 2U * 60U);
  for (const auto& [key, reward] : rewards) {
    if (key.number < 0) continue;
    EXPECT_EQ((last_rewards[{key.run, key.number + 1}]), reward);
  }
  ASSERT_EQ(runs.size(), 2U);
  std::map<int, protocol::BestPolicy> best;
  for (const auto& piece : all_of_type<protocol::BestPolicy>(events)) best[piece.run] = piece;
  for (const auto& [run, status] : runs) {
    EXPECT_TRUE(status.done);
    EXPECT_EQ(status.num_applied, 60);
    EXPECT_EQ(best[run].reward, status.best_reward);
  }
  const auto learner = all_of_type<protocol::LearnerStatus>(events).back();
  EXPECT_EQ(learner.study, "played");
  EXPECT_EQ(learner.num_runs_done, 2);
  EXPECT_EQ(learner.num_applied, 120);
  EXPECT_EQ(learner.num_evaluated, 4);
  EXPECT_EQ(learner.num_workers, 1);
  EXPECT_EQ(learner.waiting_for, "");
  const auto worker = all_of_type<protocol::WorkerStatus>(events).back();
  EXPECT_EQ(worker.pid, worker_.pid());
  EXPECT_EQ(worker.num_evaluated, static_cast<std::int64_t>(kAskedOfTwoRuns));
}

TEST_F(PlayedJournalTest, HasTheTimesOfTheJournal) {
  std::set<std::int64_t> written;
  std::ifstream bytes(journal_, std::ios::binary);
  const auto tail = read_journal_places(
      bytes, journal_.string(),
      [&](const JournalRecord&, const RecordPlace& place) { written.insert(place.wall_time_us); });
  ASSERT_TRUE(tail);
  const std::vector<Told> events = events_of(log_);
  EXPECT_EQ(events.front().time_us, *written.begin());
  EXPECT_EQ(events.back().time_us, *written.rbegin());
  EXPECT_TRUE(std::ranges::all_of(
      events, [&](const Told& event) { return written.contains(event.time_us); }));
}

TEST_F(PlayedJournalTest, TheLogplayerPlaysItAndEveryMessageIsUnderstood) {
  const std::vector<Told> written = events_of(log_);
  Hearer hearer(service_.url(), "REPLAYED_.*");
  play(log_);
  EXPECT_TRUE(hearer.hear(seconds(20), [&] { return hearer.heard().size() >= written.size(); }));
  ASSERT_EQ(hearer.heard().size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    message_of(hearer.heard()[i]);
    EXPECT_EQ(hearer.heard()[i].channel, written[i].channel);
    EXPECT_EQ(hearer.heard()[i].bytes, written[i].bytes);
  }
}

/// The worker is the one that the log names, so nothing but the channels keeps it from working.
TEST_F(PlayedJournalTest, NoWorkerRunsWhatIsPlayed) {
  Hearer hearer(service_.url(), "TREEROLL_.*");
  const auto num_evaluated = [&] {
    std::int64_t highest = 0;
    for (const Told& event : hearer.heard()) {
      if (event.channel != transport::channel_name(Channel::kWorkerStatus)) continue;
      const auto status = transport::decode(Channel::kWorkerStatus, event.bytes);
      if (!status) continue;
      highest = std::max(highest, std::get<protocol::WorkerStatus>(*status).num_evaluated);
    }
    return highest;
  };
  const auto one_more_status = [&] {
    const std::size_t before = hearer.heard().size();
    return hearer.hear(seconds(20), [&] { return hearer.heard().size() >= before + 3; });
  };
  ASSERT_TRUE(one_more_status());
  const std::int64_t before = num_evaluated();
  EXPECT_EQ(before, static_cast<std::int64_t>(kAskedOfTwoRuns));
  play(log_);
  play(as_of_a_learner_at_work(kReplayed));
  ASSERT_TRUE(one_more_status());
  EXPECT_EQ(num_evaluated(), before);
  // Not a learner, a robot or a page was told anything on the channels that they hear.
  for (const Told& event : hearer.heard()) {
    EXPECT_EQ(event.channel, transport::channel_name(Channel::kWorkerStatus));
  }
  // The hazard is real: on the live channels the same messages are work.
  play(as_of_a_learner_at_work(""));
  EXPECT_TRUE(hearer.hear(seconds(20), [&] { return num_evaluated() > before; }));
}

TEST_F(PlayedJournalTest, ALearnerThatGoesOnCountsAnew) {
  const Said extended =
      service_.run("treeroll-learner", {"--resume", journal_.parent_path().string(), "--lcm-url",
                                        service_.url(), "--set", "study.rollouts=90"});
  ASSERT_EQ(extended.status, 0) << extended.errors;
  const Said said = service_.run("treeroll-replay", {journal_.parent_path().string(), "--export",
                                                     "lcm", "--output", log_.string()});
  ASSERT_EQ(said.status, 0) << said.errors;
  const std::vector<Told> events = events_of(log_);
  const auto statuses = all_of_type<protocol::LearnerStatus>(events);
  const auto second = std::ranges::find_if(statuses, [&](const protocol::LearnerStatus& status) {
    return status.learner_id != statuses.front().learner_id;
  });
  ASSERT_NE(second, statuses.end());
  EXPECT_EQ(second->elapsed_s, 0);
  EXPECT_EQ(second->num_workers, 0);
  EXPECT_EQ(statuses.back().num_workers, 1);
  EXPECT_EQ(statuses.back().num_applied, 2 * 90);
  EXPECT_EQ(statuses.back().num_evaluated, 4);
  std::map<protocol::RolloutKey, int> answers;
  protocol::RolloutRequest asked;
  for (const Told& event : events) {
    const protocol::Message message = message_of(event);
    if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
      asked = batch->rollouts.at(0);
    } else if (const auto* batch = std::get_if<protocol::RewardBatch>(&message)) {
      EXPECT_EQ(batch->results.at(0).key, asked.key);
      EXPECT_EQ(batch->results.at(0).content, asked.content);
      ++answers[asked.key];
    }
  }
  EXPECT_EQ(answers.size(), 2U * 90U + 4U);
  for (const auto& [key, number] : answers) EXPECT_EQ(number, 1) << key.run << " " << key.number;
}

TEST_F(PlayedJournalTest, WhatIsLearntIsNeverWrittenOver) {
  const fs::path study = journal_.parent_path() / "study.toml";
  const fs::path link = service_.directory() / "link.lcmlog";
  fs::create_symlink(journal_, link);
  for (const std::string format : {"lcm", "csv", "jsonl"}) {
    for (const fs::path& output : {journal_, link, study}) {
      const std::string before = read_file(output);
      const Said said = service_.run(
          "treeroll-replay",
          {journal_.parent_path().string(), "--export", format, "--output", output.string()});
      EXPECT_EQ(said.status, 2) << format << " " << output;
      EXPECT_THAT(said.errors, HasSubstr("what is learnt is in it"));
      EXPECT_EQ(read_file(output), before) << format << " " << output;
    }
  }
}

TEST_F(PlayedJournalTest, WhatIsThereIsWrittenOverOnlyWhole) {
  const fs::path output = service_.directory() / "exports" / "old.lcmlog";
  fs::create_directory(output.parent_path());
  std::ofstream(output) << "old";
  std::fstream(journal_).seekp(static_cast<std::streamoff>(fs::file_size(journal_) / 2)).put('~');
  const Said damaged = service_.run("treeroll-replay", {journal_.parent_path().string(), "--export",
                                                        "lcm", "--output", output.string()});
  EXPECT_EQ(damaged.status, 1) << damaged.errors;
  EXPECT_EQ(read_file(output), "old");
  const fs::directory_iterator files(output.parent_path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1) << "a half of it is left";
}

TEST_F(PlayedJournalTest, SaysWhatItCannotWrite) {
  const Said refused = service_.run("treeroll-replay",
                                    {journal_.parent_path().string(), "--export", "lcm", "--output",
                                     (service_.directory() / "none" / "x.lcmlog").string()});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.errors, HasSubstr("cannot write"));
  const Said unknown =
      service_.run("treeroll-replay", {journal_.parent_path().string(), "--export", "lcmlog"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_THAT(unknown.errors, HasSubstr("lcm"));
}

}  // namespace
}  // namespace treeroll::end_to_end
