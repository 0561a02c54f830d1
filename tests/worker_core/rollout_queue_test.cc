#include "workers/core/rollout_queue.h"

#include <gtest/gtest.h>

namespace treeroll::worker {
namespace {

RolloutName name(protocol::LearnerId learner, int number) { return {learner, {0, number}}; }

void add_ready(RolloutQueue& queue, const RolloutName& name) {
  queue.add(name, {}, 1, TimePoint{});
  queue.set_state(name, RolloutState::kReady);
}

TEST(RolloutQueueTest, ServesLearnersInTurnAndEachInOrderOfArrival) {
  RolloutQueue queue;
  for (const int number : {9, 3, 6}) add_ready(queue, name(1, number));
  for (const int number : {2, 1}) add_ready(queue, name(2, number));
  std::vector<RolloutName> order;
  while (const auto next = queue.take()) order.push_back(*next);
  EXPECT_EQ(order,
            (std::vector<RolloutName>{name(1, 9), name(2, 2), name(1, 3), name(2, 1), name(1, 6)}));
}

TEST(RolloutQueueTest, KeepsThePlaceOfARolloutThatIsPutBack) {
  RolloutQueue queue;
  for (const int number : {1, 2, 3}) add_ready(queue, name(1, number));
  ASSERT_EQ(queue.take(), name(1, 1));
  queue.set_state(name(1, 1), RolloutState::kReady);
  EXPECT_EQ(queue.take(), name(1, 1));
}

TEST(RolloutQueueTest, TakesThoseOfOneLearnerAndTaskTogetherWhateverTheirPolicies) {
  RolloutQueue queue;
  const ContentHash other = content_hash("other");
  for (int number = 1; number <= 7; ++number) {
    protocol::RolloutRequest request;
    if (number == 2) request.task_id = other;
    if (number == 3) request.policy_id = other;
    queue.add(name(1, number), request, 1, TimePoint{});
    if (number == 4) queue.find(name(1, number))->mishaps.alone = true;
    if (number != 5) queue.set_state(name(1, number), RolloutState::kReady);
  }
  add_ready(queue, name(2, 8));
  EXPECT_EQ(queue.in_state(RolloutState::kReady).size(), 7U);
  const auto first = queue.take();
  ASSERT_EQ(first, name(1, 1));
  EXPECT_EQ(queue.take_beside(*first, 1, 9), (std::vector<RolloutName>{name(1, 3)}));
  EXPECT_EQ(queue.take_beside(*first, 9, 9), (std::vector<RolloutName>{name(1, 6), name(1, 7)}));
  EXPECT_EQ(queue.take_beside(*first, 9, 9), (std::vector<RolloutName>{}));
  EXPECT_EQ(queue.in_state(RolloutState::kReady).size(), 3U);
  EXPECT_EQ(queue.find(name(1, 6))->state, RolloutState::kRunning);
}

TEST(RolloutQueueTest, TakesNoMoreNumbersTogetherThanThereIsRoomFor) {
  RolloutQueue queue;
  for (const int number : {1, 2, 3, 4}) {
    protocol::RolloutRequest request;
    request.theta.assign(number == 3 ? 90 : 5, .5);
    queue.add(name(1, number), request, 1, TimePoint{});
    queue.set_state(name(1, number), RolloutState::kReady);
  }
  EXPECT_EQ(queue.take_beside(*queue.take(), 9, 99), (std::vector<RolloutName>{name(1, 2)}))
      << "the third does not fit, and none overtakes it";
}

TEST(RolloutQueueTest, LooksForThoseOfATaskAmongTheNextFewAlone) {
  RolloutQueue queue;
  const auto add = [&](int number, const char* task) {
    protocol::RolloutRequest request;
    request.task_id = content_hash(task);
    queue.add(name(1, number), request, 1, TimePoint{});
    queue.set_state(name(1, number), RolloutState::kReady);
  };
  add(0, "one");
  for (int number = 1; number <= 100; ++number) add(number, number % 4 == 0 ? "one" : "another");
  for (int number = 101; number <= 200; ++number) add(number, "another");
  add(201, "one");
  const RolloutName first = *queue.take();
  EXPECT_EQ(queue.take_beside(first, 25, 0).size(), 25U);
  EXPECT_TRUE(queue.take_beside(first, 3, 0).empty()) << "far behind others";
}

TEST(RolloutQueueTest, GivesOutNeitherWaitingNorRemovedOnes) {
  RolloutQueue queue;
  queue.add(name(1, 1), {}, 1, TimePoint{});
  add_ready(queue, name(1, 2));
  queue.remove(name(1, 2));
  EXPECT_EQ(queue.take(), std::nullopt);
  EXPECT_EQ(queue.keys(1), (std::vector<protocol::RolloutKey>{{0, 1}}));
}

}  // namespace
}  // namespace treeroll::worker
