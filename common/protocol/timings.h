#pragma once

#include <algorithm>
#include <chrono>

#include "common/base/time.h"
#include "common/protocol/limits.h"

/// The times that one process takes for granted of another: who says what again, and when it is
/// given up. What must hold between two of them is asserted below, with the reason. Times that are
/// one process's own stand where they are used.
namespace treeroll::protocol {

// A worker.

/// Its status: while it holds roll-outs, and while it does not. Where there are many workers, more
/// seldom: `Heartbeats` below.
inline constexpr Duration kBusyHeartbeat = std::chrono::milliseconds(100);
inline constexpr Duration kIdleHeartbeat = std::chrono::milliseconds(250);
/// An answer may wait so long for others to go along with, while there is work enough.
inline constexpr Duration kAnswerDelayMax = std::chrono::milliseconds(8);
/// And no longer than this share of the work that each evaluator has queued: so much less is in the
/// queue then.
inline constexpr double kAnswerShareOfWork = .25;
/// Answers that have not been seen are repeated, ever more seldom.
inline constexpr Duration kRepeatIntervalMin = std::chrono::milliseconds(3);
/// The first time where the learner's messages are lost too, so that silence is no mere slowness.
inline constexpr Duration kRepeatIntervalLossy = std::chrono::microseconds(500);
inline constexpr Duration kRepeatIntervalMax = std::chrono::seconds(1);
/// The same where all have been seen and some are not on stable storage: the word of that is lost.
inline constexpr Duration kSettleIntervalMin = std::chrono::milliseconds(250);
/// Between two requests for what is missing, ever longer; and when roll-outs without it are let go.
inline constexpr Duration kAskIntervalMin = std::chrono::milliseconds(5);
inline constexpr Duration kAskIntervalMax = std::chrono::milliseconds(50);
inline constexpr Duration kDefinitionWaitMax = std::chrono::seconds(30);
/// A learner that is silent for so long is gone: what it has asked is given up, and the evaluators
/// that work on it are ended. A trial that runs and is not repeatable is finished.
inline constexpr Duration kLearnerGone = std::chrono::seconds(12);
/// A learner that is silent for so long is forgotten, and its answers with it.
inline constexpr Duration kLearnerSilenceMax = std::chrono::seconds(60);
/// A worker that is to end waits so long for its last answers to be acknowledged.
inline constexpr Duration kDrainGrace = std::chrono::seconds(5);

// The learner.

inline constexpr Duration kLearnerStatusPeriod = std::chrono::seconds(1);
/// A worker heard of so lately is alive; the others get nothing until they are heard again.
inline constexpr Duration kWorkerAlive = std::chrono::milliseconds(600);
/// A worker that has been silent so long has left.
inline constexpr Duration kWorkerSilence = std::chrono::seconds(3);
/// Between a greeting and the next to a worker that does not answer, at first.
inline constexpr Duration kGreetingPause = std::chrono::milliseconds(100);
/// A worker that is heard and has not answered greetings for so long is named in the log.
inline constexpr Duration kDeafnessTold = std::chrono::seconds(3);
/// The shortest lease of a roll-out that no worker has said it holds; and of one that it has.
inline constexpr Duration kLeaseMin = std::chrono::milliseconds(10);
/// A lease is so many times the work that is queued before its roll-out.
inline constexpr double kLeasePerWork = 4;
inline constexpr Duration kHeldLeaseMin = std::chrono::seconds(1);
/// Between two publications of one piece of a definition, however many workers ask.
inline constexpr Duration kPublicationPause = std::chrono::milliseconds(4);
/// How long a worker may wait for the word that its answers have been seen, where no roll-outs for
/// any worker take it along sooner.
inline constexpr Duration kSeenDelayMax = std::chrono::milliseconds(1);
/// How long an accepted result may wait for stable storage; and then its worker for the word of it.
inline constexpr Duration kSyncPeriod = std::chrono::milliseconds(50);
/// A learner that ends waits so long for the local worker it has told to end.
inline constexpr Duration kLocalWorkerGrace = std::chrono::seconds(6);

// What follows from the number of workers.

/// Of all workers that one learner hears, together.
inline constexpr int kHeartbeatsPerSecondMax = 640;
/// And beside these, for learners that workers hear and do not serve: they may be made up.
inline constexpr int kWakesPerSecondMax = kHeartbeatsPerSecondMax / 4;

/// How often a worker says that it is there, and what the learner makes of its silence. The learner
/// says in its status how many workers it hears. Where they are so many that their heartbeats
/// would be more than kHeartbeatsPerSecondMax, each takes its turn less often, and all that is
/// concluded from a heartbeat that does not come waits in proportion.
struct Heartbeats {
  Duration busy = kBusyHeartbeat;
  Duration idle = kIdleHeartbeat;
  Duration wake = kIdleHeartbeat;  ///< between two that such a learner makes come sooner
  Duration alive = kWorkerAlive;
  Duration silence = kWorkerSilence;
  Duration held_lease_min = kHeldLeaseMin;
};

constexpr Heartbeats heartbeats_of(int num_workers) {
  using std::chrono::milliseconds;
  const int count = std::clamp(num_workers, 0, static_cast<int>(kWorkersMax));
  const auto turn_of = [count](int per_second) -> Duration {
    return milliseconds(std::int64_t{1000} * count / per_second);
  };
  const Duration turn = turn_of(kHeartbeatsPerSecondMax);
  Heartbeats beats;
  beats.busy = std::max(kBusyHeartbeat, turn);
  beats.idle = std::max(kIdleHeartbeat, turn);
  beats.wake = std::max(kIdleHeartbeat, turn_of(kWakesPerSecondMax));
  // In milliseconds, whose products have room.
  const auto in_proportion = [](Duration limit, Duration stretched, Duration usual) -> Duration {
    const auto count_of = [](Duration d) { return std::chrono::floor<milliseconds>(d).count(); };
    return milliseconds(count_of(limit) * count_of(stretched) / count_of(usual));
  };
  beats.alive = in_proportion(kWorkerAlive, beats.idle, kIdleHeartbeat);
  beats.silence = in_proportion(kWorkerSilence, beats.idle, kIdleHeartbeat);
  beats.held_lease_min = in_proportion(kHeldLeaseMin, beats.busy, kBusyHeartbeat);
  return beats;
}

// What must hold between them.

/// For few workers, for the most, and for numbers in between.
constexpr bool hold_for_any_number(bool (*relation)(const Heartbeats&)) {
  for (int count = 0; count <= static_cast<int>(kWorkersMax); count += 32) {
    if (!relation(heartbeats_of(count))) return false;
  }
  return true;
}

static_assert(hold_for_any_number([](const Heartbeats& b) { return 2 * b.idle < b.alive; }),
              "a worker that is heard at every second heartbeat is given roll-outs");
static_assert(hold_for_any_number([](const Heartbeats& b) { return b.busy <= b.idle; }),
              "what holds for the slower heartbeat holds for the faster one");
static_assert(hold_for_any_number([](const Heartbeats& b) { return b.alive < b.silence; }),
              "a worker gets nothing more before what it has is given to others");
static_assert(hold_for_any_number([](const Heartbeats& b) { return 10 * b.idle < b.silence; }),
              "ten heartbeats lost in a row are no accident, fewer may be");
static_assert(
    hold_for_any_number([](const Heartbeats& b) { return 5 * b.busy < b.held_lease_min; }),
    "a roll-out that is held is named again, four losses in between, before its lease ends");
static_assert(kRepeatIntervalMin < kLeaseMin,
              "an answer that was lost is repeated before its roll-out is asked for again");
static_assert(8 * kAnswerShareOfWork < kLeasePerWork,
              "a lease outlasts the time an answer waits for others");
static_assert(2 * kSeenDelayMax < kRepeatIntervalMin,
              "what has been seen is not repeated before its worker can know");
static_assert(4 * kSyncPeriod < kSettleIntervalMin,
              "what waits for the disk is not repeated for that");
static_assert(kSettleIntervalMin < kRepeatIntervalMax, "both slow down to the same pace");
static_assert(kPublicationPause < kAskIntervalMin,
              "a piece may be published again by the time it is asked for again");
static_assert(10 * kAskIntervalMax < kDefinitionWaitMax,
              "a definition is asked for many times before its roll-outs are let go");
static_assert(10 * kLearnerStatusPeriod < kLearnerGone,
              "a learner with nothing to give out is not gone for some lost messages");
static_assert(kLearnerGone < kLearnerSilenceMax,
              "a learner that comes back finds the answers to what it had asked");
static_assert(kWorkerSilence < kLearnerGone,
              "a worker of few that is cut off is given up by the learner before it gives up its "
              "work; one of very many gives it up first, and says so when it is heard again");
static_assert(kGreetingPause < kIdleHeartbeat,
              "a greeting that was lost is repeated at the next heartbeat");
static_assert(10 * kIdleHeartbeat < kDeafnessTold,
              "a worker that hears has said so many times before it is named as deaf");
static_assert(2 * kRepeatIntervalMax < kDrainGrace,
              "the last answers are repeated before a worker ends without an acknowledgement");
static_assert(kDrainGrace < kLocalWorkerGrace,
              "a learner does not kill its worker while that waits for it");

}  // namespace treeroll::protocol
