#include "learner/core/dispatch.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/protocol/limits.h"
#include "common/protocol/wire_sizes.h"
#include "learner/core/batching.h"
#include "tests/learner_core/moment.h"

namespace treeroll::learner {
namespace {

using std::chrono::milliseconds;

WorkerEntry& add_worker(WorkerTable& workers, protocol::WorkerId id, int evaluators) {
  WorkerEntry& worker = *workers.hear(id, at(0));
  worker.num_evaluators = evaluators;
  worker.free_slots = 64 * evaluators;
  worker.receive_buffer_bytes = 4 << 20;
  worker.hearing.note_word(at(0), 1);
  worker.hearing.note_echo(1);
  return worker;
}

Ledger with_draws(int count) {
  Ledger ledger;
  for (int number = 0; number < count; ++number) {
    Question question;
    question.theta = Eigen::VectorXd::Constant(2, number);
    seal(question, {0, number});
    ledger.draw({0, number}, question);
  }
  return ledger;
}

const std::map<ContentHash, TaskDescription> kTasks{{ContentHash{}, TaskDescription{}}};

TEST(DispatchTest, FillsWorkersInProportionToTheirEvaluators) {
  Ledger ledger = with_draws(9);
  WorkerTable workers;
  add_worker(workers, 1, 2);
  add_worker(workers, 2, 1);
  const auto chosen = assign(ledger, workers, {at(0), 1, &kTasks});
  EXPECT_EQ(chosen.size(), 6U);  // two for each evaluator
  ledger.lease(at(0), chosen);
  EXPECT_EQ(ledger.leases_of(1).size(), 4U);
  EXPECT_EQ(ledger.leases_of(2).size(), 2U);
  EXPECT_EQ(workers.find(1)->free_slots, 124);
}

TEST(DispatchTest, RespectsTheRoomAWorkerReports) {
  Ledger ledger = with_draws(9);
  WorkerTable workers;
  add_worker(workers, 1, 4).free_slots = 3;
  EXPECT_EQ(assign(ledger, workers, {at(0), 1, &kTasks}).size(), 3U);
}

TEST(DispatchTest, GivesNothingToWorkersThatDrainOrRefuseTheDefinition) {
  Ledger ledger = with_draws(2);
  WorkerTable workers;
  add_worker(workers, 1, 1).draining = true;
  add_worker(workers, 2, 1).refused[ContentHash{}] = {"unknown", at(1000)};
  add_worker(workers, 3, 1).distrusted = true;
  EXPECT_TRUE(assign(ledger, workers, {at(0), 1, &kTasks}).empty());
}

TEST(DispatchTest, HoldsBackTasksNobodyHasDescribed) {
  Ledger ledger = with_draws(2);
  WorkerTable workers;
  add_worker(workers, 1, 1);
  const std::map<ContentHash, TaskDescription> none;
  EXPECT_TRUE(assign(ledger, workers, {at(0), 1, &none}).empty());
}

TEST(DispatchTest, ReturnsAReissuedRolloutToItsWorkerWhileThatIsAlive) {
  for (const bool alive : {true, false}) {
    Ledger ledger = with_draws(1);
    WorkerTable workers;
    add_worker(workers, 1, 1);
    add_worker(workers, 2, 1);
    ledger.lease(at(0), {{0, 2, at(50)}});
    ledger.expire(at(1000));
    workers.hear(1, at(1000));
    if (alive) workers.hear(2, at(1000));
    const auto chosen = assign(ledger, workers, {at(1001), 1, &kTasks});
    ASSERT_EQ(chosen.size(), 1U);
    EXPECT_EQ(chosen[0].worker, alive ? 2 : 1);
  }
}

TEST(DispatchTest, GivesNothingToAWorkerThatIsHeardAndHasNotAnswered) {
  Ledger ledger = with_draws(3);
  WorkerTable workers;
  add_worker(workers, 1, 8).hearing = {};
  EXPECT_TRUE(assign(ledger, workers, {at(0), 1, &kTasks}).empty());
  add_worker(workers, 2, 1);
  for (const auto& each : assign(ledger, workers, {at(0), 1, &kTasks})) EXPECT_EQ(each.worker, 2);
}

TEST(DispatchTest, PrefersOthersOnceAWorkerHasLostTwoLeases) {
  for (const int num_lost : {1, 2}) {
    Ledger ledger = with_draws(1);
    WorkerTable workers;
    WorkerEntry& doubtful = add_worker(workers, 1, 4);
    add_worker(workers, 2, 1);
    ledger.lease(at(0), {{0, 1, at(50)}});
    for (int i = 0; i < num_lost; ++i) doubtful.hearing.note_lost(at(i), at(i));
    ledger.expire(at(50));
    const auto chosen = assign(ledger, workers, {at(51), 1, &kTasks});
    ASSERT_EQ(chosen.size(), 1U);
    EXPECT_EQ(chosen[0].worker, num_lost == 1 ? 1 : 2);
  }
}

/// One roll-out that this worker has answered, to be run again.
Ledger with_answered_by(const WorkerEntry& worker) {
  Question question;
  question.theta = Eigen::VectorXd::Constant(2, 0);
  question.answered_by = {worker.as_known()};
  seal(question, {0, 0});
  Ledger ledger;
  ledger.draw({0, 0}, question);
  return ledger;
}

protocol::WorkerId asked_again(const Ledger& ledger, WorkerTable& workers) {
  const auto chosen = assign(ledger, workers, {at(0), 1, &kTasks});
  return chosen.empty() ? 0 : chosen[0].worker;
}

TEST(DispatchTest, WhatIsRunAgainGoesToAnotherHostWhereOneHasRoom) {
  WorkerTable workers;
  WorkerEntry& first = add_worker(workers, 1, 2);
  first.host = "a";
  WorkerEntry& beside = add_worker(workers, 2, 2);
  beside.host = "a";
  WorkerEntry& elsewhere = add_worker(workers, 3, 1);
  elsewhere.host = "b";
  Ledger ledger = with_answered_by(first);
  ledger.draw({0, 7}, Question{});
  ledger.lease(at(0), {{1, 3, at(50)}});
  EXPECT_EQ(asked_again(ledger, workers), 3) << "although it has more to do";
  elsewhere.free_slots = 0;
  EXPECT_EQ(asked_again(ledger, workers), 2) << "nobody is waited for";
  elsewhere.free_slots = 64;
  elsewhere.late = true;
  EXPECT_EQ(asked_again(ledger, workers), 2) << "who is late may be waited for";
  beside.free_slots = 0;
  EXPECT_EQ(asked_again(ledger, workers), 3);
}

TEST(DispatchTest, WhatIsRunAgainGoesToAnotherKeyWhereOneHasRoom) {
  constexpr protocol::WorkerId kKey = protocol::WorkerId{5} << protocol::kOwnNameBits;
  WorkerTable workers(/*has_keys=*/true);
  const protocol::WorkerId other_key = (protocol::WorkerId{6} << protocol::kOwnNameBits) + 1;
  for (const protocol::WorkerId id : {kKey + 1, kKey + 2, other_key}) {
    add_worker(workers, id, 1).host = "host" + std::to_string(id);
  }
  EXPECT_EQ(asked_again(with_answered_by(*workers.find(kKey + 1)), workers), other_key);
}

TEST(DispatchTest, WhatIsRunTheFirstTimeGoesToWhoHasLeastToDoWhateverItsHost) {
  Ledger ledger = with_draws(2);
  WorkerTable workers;
  for (const protocol::WorkerId id : {1, 2}) add_worker(workers, id, 1).host = "a";
  const auto chosen = assign(ledger, workers, {at(0), 1, &kTasks});
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_NE(chosen[0].worker, chosen[1].worker);
}

TEST(DispatchTest, PrefersOthersToAWorkerThatIsLate) {
  Ledger ledger = with_draws(3);
  WorkerTable workers;
  add_worker(workers, 1, 4).late = true;
  add_worker(workers, 2, 1);
  const auto chosen = assign(ledger, workers, {at(0), 1, &kTasks});
  ASSERT_EQ(chosen.size(), 3U);
  EXPECT_EQ(chosen[0].worker, 2);
  EXPECT_EQ(chosen[1].worker, 2);
  EXPECT_EQ(chosen[2].worker, 1) << "the other one has no more room";
}

TEST(DispatchTest, GivesNothingToAWorkerThatHasFallenSilent) {
  Ledger ledger = with_draws(1);
  WorkerTable workers;
  add_worker(workers, 1, 1);
  workers.hear(1, at(0));
  EXPECT_TRUE(assign(ledger, workers, {at(700), 1, &kTasks}).empty());
  workers.hear(1, at(700));
  EXPECT_EQ(assign(ledger, workers, {at(701), 1, &kTasks}).size(), 1U);
}

TEST(DispatchTest, TheWindowGrowsForShortRolloutsAndFitsTheReceiveBuffer) {
  WorkerTable workers;
  WorkerEntry& worker = add_worker(workers, 1, 2);
  EXPECT_EQ(window(worker, 0), 4);
  EXPECT_EQ(window(worker, 1), 4);
  EXPECT_EQ(window(worker, 1e-3), 84);
  EXPECT_EQ(window(worker, 50e-6), 128);
  worker.receive_buffer_bytes = 20 * 1024;
  EXPECT_EQ(window(worker, 50e-6), 10);
}

TEST(DispatchTest, AWorkerIsGivenNoMoreThanItCanNameInOneMessage) {
  WorkerTable workers;
  WorkerEntry& worker = add_worker(workers, 1, protocol::kEvaluatorsPerWorkerMax);
  worker.receive_buffer_bytes = std::numeric_limits<int>::max();
  worker.free_slots = std::numeric_limits<int>::max();  // whatever it says
  worker.num_accepted = 1000;                           // it has shown that it has them
  EXPECT_EQ(window(worker, 50e-6), protocol::kLeasesPerWorkerMax);
  Ledger ledger = with_draws(protocol::kLeasesPerWorkerMax + 100);
  EXPECT_EQ(assign(ledger, workers, {at(0), 50e-6, &kTasks}).size(),
            static_cast<std::size_t>(protocol::kLeasesPerWorkerMax));
}

TEST(DispatchTest, ALeaseLastsFourTimesWhatAnAnswerTakes) {
  WorkerTable workers;
  WorkerEntry& worker = add_worker(workers, 1, 2);
  EXPECT_EQ(lease_duration(worker, 0, 0), std::chrono::seconds(1));
  worker.answer_time_s = .5;
  EXPECT_EQ(lease_duration(worker, 0, .01), std::chrono::seconds(2));
  worker.answer_time_s = 1e-3;
  EXPECT_EQ(lease_duration(worker, 0, 1e-3), milliseconds(10));
  EXPECT_EQ(lease_duration(worker, 9, .1), std::chrono::seconds(2));  // 10 on 2 evaluators
}

protocol::RolloutRequest request(int theta_dim) {
  protocol::RolloutRequest request;
  request.theta.resize(theta_dim);
  return request;
}

TEST(BatchingTest, FillsMessagesToTheirSizeInOrder) {
  std::vector<protocol::RolloutRequest> requests;
  for (int number = 0; number < 100; ++number) {
    requests.push_back(request(12));
    requests.back().key.number = number;
  }
  const auto batches = pack(requests, {{1, 5}}, 1400);
  ASSERT_GT(batches.size(), 10U);
  EXPECT_EQ(batches[0].acknowledgements.size(), 1U);
  int number = 0;
  for (const protocol::RolloutBatch& batch : batches) {
    std::size_t bytes = 0;
    for (const auto& rollout : batch.rollouts) {
      EXPECT_EQ(rollout.key.number, number++);
      bytes += protocol::rollout_request_bytes(rollout.theta.size());
    }
    EXPECT_LT(bytes, 1400U);
  }
  EXPECT_EQ(number, 100);
}

TEST(BatchingTest, SendsARolloutThatIsLargerThanABatchAlone) {
  const auto batches = pack({request(4), request(400), request(4)}, {}, 1400);
  ASSERT_EQ(batches.size(), 3U);
  EXPECT_EQ(batches[1].rollouts.size(), 1U);
}

TEST(BatchingTest, SendsNothingWhenThereIsNothing) { EXPECT_TRUE(pack({}, {}, 1400).empty()); }

}  // namespace
}  // namespace treeroll::learner
