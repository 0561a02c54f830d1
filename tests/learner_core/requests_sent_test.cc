#include "learner/core/requests_sent.h"

#include <gtest/gtest.h>

#include "common/protocol/limits.h"

namespace treeroll::learner {
namespace {

TEST(RequestsSentTest, TellsOnceWhatHasComeAndWhatWasLost) {
  RequestsSent sent;
  sent.note(5, {0, 1});
  sent.note(5, {0, 2});
  sent.note(6, {0, 3});
  sent.note(8, {0, 4});
  const RequestsSent::Report report = sent.take(/*last_batch=*/7, /*received=*/0b101);
  ASSERT_EQ(report.arrived.size(), 2U);
  EXPECT_EQ(report.arrived[1].batch, 5);
  EXPECT_EQ(report.arrived[1].key, (protocol::RolloutKey{0, 2}));
  ASSERT_EQ(report.lost.size(), 1U);
  EXPECT_EQ(report.lost[0].key, (protocol::RolloutKey{0, 3}));
  EXPECT_TRUE(sent.take(7, 0).lost.empty());
  EXPECT_EQ(sent.take(8, 1).arrived.size(), 1U);
}

TEST(RequestsSentTest, SaysNothingOfWhatNoBitIsThereFor) {
  RequestsSent sent;
  sent.note(1, {0, 1});
  sent.note(2, {0, 2});
  const RequestsSent::Report report = sent.take(65, -1);
  EXPECT_EQ(report.arrived.size(), 1U) << "the oldest of the 64";
  EXPECT_TRUE(report.lost.empty());
}

TEST(RequestsSentTest, ForgetsTheOldestOfAWorkerThatSaysNothing) {
  RequestsSent sent;
  for (int batch = 1; batch <= 1000; ++batch) sent.note(batch, {0, batch});
  EXPECT_EQ(std::ssize(sent.take(1000, 0).lost), protocol::kBatchBits);
}

}  // namespace
}  // namespace treeroll::learner
