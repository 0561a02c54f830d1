#include "common/transport/authenticator.h"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "common/protocol/wire_sizes.h"
#include "common/transport/codec.h"
#include "tests/transport/signing_side.h"

namespace treeroll::transport {
namespace {

using protocol::Message;
using testing::HasSubstr;

TEST(AuthenticatorTest, WhoSignsNothingIsRefusedByName) {
  const auto unsigned_of = [](const Message& message) {
    return Signed{channel_of(message), encode(message)};
  };
  EXPECT_THAT(Side(learner_ring()).hear(unsigned_of(status_of(kWorker))),
              HasSubstr("worker 1099511627781 signs nothing: it runs without --key-file"));
  EXPECT_THAT(Side(worker_ring(1)).hear(unsigned_of(learner_status())),
              HasSubstr("learner 77 signs nothing"));
}

TEST(AuthenticatorTest, WhoHasAnotherKeyIsRefused) {
  Side stranger(learner_ring(9));
  EXPECT_THAT(Side(learner_ring()).hear(stranger.say(status_of(kWorker))),
              HasSubstr("does not follow from ours"));
  EXPECT_THAT(Side(worker_ring(1)).hear(stranger.say(learner_status())),
              HasSubstr("not in our key file"));
}

TEST(AuthenticatorTest, AMessageIsTakenOnceInAnyOrder) {
  MetPair pair;
  std::vector<Signed> sent;
  for (int i = 0; i < 10; ++i) sent.push_back(pair.learner.say(learner_status()));
  for (const int i : {3, 0, 9, 1}) {
    EXPECT_EQ(pair.worker.hear(sent[static_cast<std::size_t>(i)]), "taken");
  }
  for (const int i : {3, 0, 9, 1}) {
    EXPECT_EQ(pair.worker.hear(sent[static_cast<std::size_t>(i)]), "replayed");
  }
}

TEST(AuthenticatorTest, WhatIsOvertakenByTooManyCountsAsLost) {
  ReplayWindow window(10);
  EXPECT_FALSE(window.take(9));
  EXPECT_TRUE(window.take(10));
  EXPECT_TRUE(window.take(12 + ReplayWindow::kSize));
  EXPECT_FALSE(window.take(11));
  EXPECT_TRUE(window.take(13));
  EXPECT_FALSE(window.take(13));
  EXPECT_TRUE(window.take(5 * ReplayWindow::kSize));
  EXPECT_TRUE(window.take(5 * ReplayWindow::kSize - 12));
}

TEST(AuthenticatorTest, ALearnerThatHasNotNamedUsProvesNothing) {
  Side learner(learner_ring());
  Side worker(worker_ring(1));
  const Signed status = worker.say(status_of(kWorker));
  EXPECT_EQ(worker.hear(learner.say(learner_status())), "taken");  // it is answered with a status
  EXPECT_EQ(worker.hear(learner.say(piece())), "unproven");
  EXPECT_EQ(worker.hear(learner.say(batch_to({kOther}))), "unproven");
  EXPECT_EQ(learner.hear(status), "taken");
  EXPECT_EQ(worker.hear(learner.say(batch_to({kWorker}))), "taken");
  EXPECT_EQ(worker.hear(learner.say(piece())), "taken");
}

TEST(AuthenticatorTest, WhatCameBeforeTheProofIsNotTakenAfterIt) {
  Side learner(learner_ring());
  Side worker(worker_ring(1));
  const Signed before = learner.say(piece());
  learner.hear(worker.say(status_of(kWorker)));
  EXPECT_EQ(worker.hear(learner.say(batch_to({kWorker}))), "taken");
  EXPECT_EQ(worker.hear(before), "replayed");
}

/// A recording of a whole session is played to those who come after it.
TEST(AuthenticatorTest, ARecordingOfAnOlderSessionIsWorthNothing) {
  MetPair pair;
  protocol::WorkerStatus held = status_of(kWorker);
  held.held.push_back({.learner_id = kLearner, .last_batch = 1, .keys = {}});
  const std::vector<Signed> of_worker = {pair.worker.say(held), pair.worker.say(answer(kWorker))};
  const std::vector<Signed> of_learner = {pair.learner.say(lease_to(kWorker)),
                                          pair.learner.say(piece())};

  Side next_learner(learner_ring());
  next_learner.say(batch_to({}, kLearner + 1));
  EXPECT_EQ(next_learner.hear(of_worker[0]), "taken");  // is greeted, and answers nothing
  EXPECT_EQ(next_learner.hear(of_worker[1]), "unproven");
  Side next_worker(worker_ring(1));
  next_worker.say(status_of(kWorker + 100));
  for (const Signed& datagram : of_learner) EXPECT_EQ(next_worker.hear(datagram), "unproven");
}

TEST(AuthenticatorTest, AWorkersKeySpeaksForNoOtherWorker) {
  MetPair pair;
  Side insider(worker_ring(2));
  EXPECT_THAT(pair.learner.hear(insider.say(answer(kWorker))),
              HasSubstr("another key, or none, speaks in the name"));
  EXPECT_EQ(pair.learner.hear(insider.say(answer(kOther))), "taken");
}

/// Who holds a worker's key knows the key of announcements, but not that of another worker.
TEST(AuthenticatorTest, AWorkersKeyLeasesNothing) {
  MetPair pair;
  // It has heard nobody: its batch is signed with the announcement key alone.
  Side insider(learner_ring());
  EXPECT_EQ(pair.worker.hear(insider.say(lease_to(kWorker))), "forged");
  EXPECT_EQ(pair.worker.hear(insider.say(batch_to({kWorker, kOther}))), "forged");
  EXPECT_EQ(pair.worker.hear(pair.learner.say(lease_to(kWorker))), "taken");
}

/// A worker's name is in every status. As a learner's name it belongs to nobody.
TEST(AuthenticatorTest, NobodySpeaksAsALearnerInAWorkersOwnName) {
  MetPair pair;
  Side insider(learner_ring());
  protocol::RolloutBatch lease = lease_to(kWorker);
  lease.learner_id = kWorker;
  EXPECT_EQ(pair.worker.hear(insider.say(lease)), "forged");
  EXPECT_EQ(pair.worker.hear(insider.say(batch_to({kWorker}, kWorker))), "forged");
  protocol::DefinitionPiece definition = piece();
  definition.learner_id = kWorker;
  EXPECT_EQ(pair.worker.hear(insider.say(definition)), "forged");
  // What one has said itself comes back to it.
  EXPECT_EQ(pair.learner.hear(pair.learner.say(learner_status())), "taken");
  EXPECT_EQ(pair.learner.hear(insider.say_as_number(learner_status(), 1'000)), "forged");
}

TEST(AuthenticatorTest, NoAnnouncementSilencesALearner) {
  MetPair pair;
  Side insider(learner_ring());
  const Signed before = pair.learner.say(lease_to(kWorker));
  EXPECT_EQ(pair.worker.hear(before), "taken");
  for (const auto& message : {Message(learner_status()), Message(batch_to({kOther}))}) {
    EXPECT_EQ(pair.worker.hear(insider.say_as_number(message, std::int64_t{1} << 62U)), "taken");
    EXPECT_EQ(pair.worker.hear(before), "replayed");
    EXPECT_EQ(pair.worker.hear(pair.learner.say(lease_to(kWorker))), "taken");
    EXPECT_EQ(pair.worker.hear(pair.learner.say(piece())), "taken");
  }
}

TEST(AuthenticatorTest, ABatchIsSignedForEachWorkerThatItNames) {
  Side learner(learner_ring());
  Side one(worker_ring(1));
  Side other(worker_ring(2));
  learner.hear(one.say(status_of(kWorker)));
  learner.hear(other.say(status_of(kOther)));
  protocol::RolloutBatch batch = lease_to(kOther);
  batch.acknowledgements = {{kOther, 1, 1}, {kWorker, 2, 2}, {kWorker + 50, 3, 3}};
  const std::size_t unsigned_size = encode(batch).size();
  const Signed datagram = learner.say(batch);
  EXPECT_EQ(datagram.bytes.size(), unsigned_size + 3 * protocol::kWordMacBytes);
  EXPECT_EQ(one.hear(datagram), "taken");
  EXPECT_EQ(other.hear(datagram), "taken");
}

TEST(AuthenticatorTest, ALearnersKeyServesAWorkerToo) {
  Side learner(learner_ring());
  Side worker(learner_ring());
  EXPECT_EQ(learner.hear(worker.say(status_of(kWorker))), "taken");
  EXPECT_EQ(worker.hear(learner.say(lease_to(kWorker))), "taken");
  EXPECT_EQ(learner.hear(worker.say(answer(kWorker))), "taken");
}

/// The order that deploy/doc/security.md gives, one process at a time: nothing is ever refused.
TEST(AuthenticatorTest, KeysChangeWithoutAStop) {
  const std::string old_key = line_of(learner_key(1));
  const std::string new_key = line_of(learner_key(2));
  const std::string old_worker = line_of(worker_key(learner_key(1), kHost));
  const std::string new_worker = line_of(worker_key(learner_key(2), kHost));
  Side learner(ring(old_key));
  Side worker(ring(old_worker));
  learner.hear(worker.say(status_of(kWorker)));
  const auto talk = [&] {
    EXPECT_EQ(worker.hear(learner.say(lease_to(kWorker))), "taken");
    EXPECT_EQ(worker.hear(learner.say(piece())), "taken");
    EXPECT_EQ(learner.hear(worker.say(answer(kWorker))), "taken");
    EXPECT_EQ(learner.hear(worker.say(status_of(kWorker))), "taken");
    EXPECT_EQ(worker.hear(learner.say(lease_to(kWorker))), "taken");
  };
  talk();
  learner.authenticator.set_keys(ring(old_key + "\n" + new_key));
  talk();
  worker.authenticator.set_keys(ring(new_worker + "\n" + old_worker));
  talk();
  learner.authenticator.set_keys(ring(new_key));
  talk();
  worker.authenticator.set_keys(ring(new_worker));
  talk();
}

/// Nothing has been heard of the worker between: it takes words of either key.
TEST(AuthenticatorTest, AWorkerThatIsSilentMeanwhileFollowsTheNewKey) {
  MetPair pair;
  const std::string new_worker = line_of(worker_key(learner_key(2), kHost));
  pair.worker.authenticator.set_keys(
      ring(new_worker + "\n" + line_of(worker_key(learner_key(1), kHost))));
  pair.learner.authenticator.set_keys(learner_ring(2));
  EXPECT_EQ(pair.worker.hear(pair.learner.say(lease_to(kWorker))), "taken");
}

TEST(AuthenticatorTest, WhoOnlyWatchesTakesWhatIsSignedOnce) {
  Side learner(learner_ring());
  Side watcher(learner_ring(), true);
  protocol::RunStatus run;
  run.learner_id = kLearner;
  const Signed datagram = learner.say(run);
  EXPECT_EQ(watcher.hear(datagram), "taken");
  EXPECT_EQ(watcher.hear(datagram), "replayed");
  EXPECT_THAT(watcher.hear({Channel::kRunStatus, encode(run)}), HasSubstr("signs nothing"));
}

TEST(AuthenticatorTest, FloodsOfMadeUpSendersAreBoundedAndCostTheKnownNothing) {
  MetPair pair;
  EXPECT_EQ(pair.learner.hear(pair.worker.say(answer(kWorker))), "taken");
  const Signed heard = pair.worker.say(answer(kWorker));
  EXPECT_EQ(pair.learner.hear(heard), "taken");
  Side crowd(worker_ring(2));
  for (std::int64_t i = 0; i < 17'000; ++i) {
    ASSERT_EQ(pair.learner.hear(crowd.say(status_of(kOther + 1000 + i))), "taken");
    // It names the learner: to be alive costs a made-up name nothing.
    ASSERT_EQ(pair.learner.hear(crowd.say(answer(kOther + 1000 + i))), "taken");
  }
  EXPECT_EQ(pair.learner.hear(heard), "replayed");
  EXPECT_EQ(pair.worker.hear(pair.learner.say(lease_to(kWorker))), "taken");
}

}  // namespace
}  // namespace treeroll::transport
