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
