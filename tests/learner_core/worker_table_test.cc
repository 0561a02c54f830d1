#include "learner/core/worker_table.h"

#include <gtest/gtest.h>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

using protocol::heartbeats_of;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(WorkerTableTest, SilenceIsWaitedForAsLongAsManyWorkersMayTake) {
  WorkerTable table;
  table.hear(1, TimePoint{});
  table.note_told(TimePoint{}, 4096);
  const WorkerEntry& worker = *table.find(1);
  EXPECT_TRUE(worker.is_alive(TimePoint(seconds(15))));
  EXPECT_FALSE(worker.is_alive(TimePoint(seconds(16))));
  EXPECT_TRUE(table.remove_silent(TimePoint(seconds(76))).empty());
  EXPECT_EQ(table.remove_silent(TimePoint(seconds(77))).size(), 1U);
}

TEST(WorkerTableTest, WhoHasMissedThatTheyAreFewerIsNotTakenForSilent) {
  WorkerTable table;
  table.note_told(TimePoint{}, 4096);
  table.hear(1, TimePoint{});
  for (int i = 0; i < 12; ++i) table.note_told(TimePoint(seconds(i)), 1);
  // It may beat as thousands do until its learner is gone for it.
  EXPECT_GT(table.heartbeats().silence, 3 * heartbeats_of(4096).idle);
  for (int i = 12; i < 200; ++i) table.note_told(TimePoint(seconds(i)), 1);
  EXPECT_EQ(table.heartbeats().silence, protocol::kWorkerSilence);
  EXPECT_EQ(table.remove_silent(TimePoint(seconds(200))).size(), 1U) << "it is looked at anew";
}

WorkerEntry& join(WorkerTable& table, protocol::WorkerId id, TimePoint now) {
  WorkerEntry& worker = *table.hear(id, now);
  worker.joined = true;
  return worker;
}

/// A greeting can be heard by all, and so answered in names that somebody makes up.
TEST(WorkerTableTest, WhoHasAnsweredNothingButAGreetingForAMinuteMakesRoom) {
  WorkerTable table;
  for (int id = 1; id <= static_cast<int>(protocol::kWorkersMax); ++id) {
    join(table, id, TimePoint{}).num_accepted = id <= 2 ? 1 : 0;
  }
  ASSERT_TRUE(table.is_full());
  EXPECT_EQ(table.hear(5000, TimePoint(seconds(59))), nullptr);
  EXPECT_TRUE(table.take_put_out().empty());
  join(table, 5000, TimePoint(seconds(60)));
  EXPECT_EQ(table.take_put_out(), std::vector<protocol::WorkerId>{3})
      << "the first without an answer";
  EXPECT_EQ(table.find(3), nullptr);
  EXPECT_EQ(table.hear(5001, TimePoint(seconds(60))), nullptr) << "one at a time";
  EXPECT_NE(table.hear(5001, TimePoint(milliseconds(60'100))), nullptr);
  EXPECT_EQ(table.take_put_out(), std::vector<protocol::WorkerId>{4});
  EXPECT_NE(table.find(1), nullptr);
  EXPECT_NE(table.find(2), nullptr);
}

constexpr auto kOfOneKey = std::int64_t{7} << protocol::kOwnNameBits;

TEST(WorkerTableTest, OneKeyHasAQuarterOfTheNames) {
  WorkerTable table(/*has_keys=*/true);
  WorkerTable without_keys;
  for (int i = 0; i < protocol::kWorkersOfOneKeyMax; ++i) {
    join(table, kOfOneKey + i, TimePoint{}).num_accepted = 1;
    join(without_keys, kOfOneKey + i, TimePoint{}).num_accepted = 1;
  }
  EXPECT_EQ(table.hear(kOfOneKey + protocol::kWorkersOfOneKeyMax, TimePoint{}), nullptr);
  EXPECT_NE(without_keys.hear(kOfOneKey + protocol::kWorkersOfOneKeyMax, TimePoint{}), nullptr);
  EXPECT_NE(table.hear(3 * kOfOneKey, TimePoint{}), nullptr) << "of another key";
  EXPECT_NE(table.hear(kOfOneKey, TimePoint(seconds(1))), nullptr) << "who is there stays";
  EXPECT_EQ(table.remove_silent(TimePoint(seconds(3))).size(), protocol::kWorkersOfOneKeyMax);
  EXPECT_NE(table.hear(kOfOneKey + protocol::kWorkersOfOneKeyMax, TimePoint(seconds(4))), nullptr);
}

/// Of all workers that one key has had, a recording has a signed word.
TEST(WorkerTableTest, OfOneKeyWhoHasAnsweredNoGreetingMakesRoomTheFirstHeardFirst) {
  WorkerTable table(/*has_keys=*/true);
  table.hear(1, TimePoint{});  // of another key, and before all
  join(table, kOfOneKey, TimePoint{});
  for (int i = 1; i < protocol::kWorkersOfOneKeyMax; ++i) table.hear(kOfOneKey + i, TimePoint{});
  EXPECT_NE(table.hear(kOfOneKey + protocol::kWorkersOfOneKeyMax, TimePoint{}), nullptr);
  EXPECT_EQ(table.take_put_out(), std::vector<protocol::WorkerId>{kOfOneKey + 1});
  EXPECT_NE(table.hear(kOfOneKey + 1, TimePoint{}), nullptr) << "comes back as the last";
  EXPECT_EQ(table.take_put_out(), std::vector<protocol::WorkerId>{kOfOneKey + 2});
  EXPECT_NE(table.find(1), nullptr);
  EXPECT_NE(table.find(kOfOneKey), nullptr);
}

TEST(WorkerTableTest, OfOneKeyWhoHasAnsweredNothingButAGreetingForAMinuteMakesRoom) {
  WorkerTable table(/*has_keys=*/true);
  for (int i = 0; i < protocol::kWorkersOfOneKeyMax; ++i) {
    join(table, kOfOneKey + i, TimePoint{}).num_accepted = i == 0 ? 1 : 0;
  }
  const protocol::WorkerId next = kOfOneKey + protocol::kWorkersOfOneKeyMax;
  EXPECT_EQ(table.hear(next, TimePoint(seconds(59))), nullptr);
  join(table, next, TimePoint(seconds(60)));
  EXPECT_EQ(table.take_put_out(), std::vector<protocol::WorkerId>{kOfOneKey + 1});
  EXPECT_EQ(table.hear(next + 1, TimePoint(seconds(60))), nullptr) << "one at a time";
}

/// Thousands that join at once are told how many they are before they have beaten twice.
TEST(WorkerTableTest, ALearnerTellsACrowdThatJoinsHowManyTheyAre) {
  Cluster cluster(small_study(10, 1));
  for (int id = 1; id <= 300; ++id) cluster.add_worker(id, seconds(1));
  cluster.start();
  cluster.run(milliseconds(200));
  int told = 0;
  for (const protocol::Message& message : cluster.sent) {
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
      told = status->num_workers;
    }
  }
  EXPECT_EQ(told, 300);
}

}  // namespace
}  // namespace treeroll::learner
