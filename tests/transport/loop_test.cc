#include "common/transport/loop.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <vector>

namespace treeroll::transport {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

/// A pipe-like pair of descriptors.
class Pair {
 public:
  Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data()), 0); }
  ~Pair() {
    for (const int end : ends_) close(end);
  }
  int reader() const { return ends_[0]; }
  void write(char c) const { EXPECT_EQ(::write(ends_[1], &c, 1), 1); }
  char read() const {
    char c = 0;
    EXPECT_EQ(::read(ends_[0], &c, 1), 1);
    return c;
  }

 private:
  std::array<int, 2> ends_{};
};

TEST(LoopTest, ATimerRunsOnceAndNotBeforeItsDeadline) {
  Loop loop;
  const TimePoint deadline = loop.now() + milliseconds(5);
  std::vector<TimePoint> ran;
  Timer timer(loop, [&] { ran.push_back(loop.now()); });
  Timer end(loop, [&] { loop.stop(); });
  timer.set(deadline);
  end.set(deadline + milliseconds(5));
  EXPECT_TRUE(timer.is_set());
  loop.run();
  ASSERT_EQ(ran.size(), 1U);
  EXPECT_GE(ran[0], deadline);
  EXPECT_FALSE(timer.is_set());
}

TEST(LoopTest, ALaterDeadlineReplacesTheOneBefore) {
  Loop loop;
  const TimePoint start = loop.now();
  std::vector<TimePoint> ran;
  Timer timer(loop, [&] {
    ran.push_back(loop.now());
    loop.stop();
  });
  timer.set(start);
  timer.set(start + milliseconds(2));
  loop.run();
  ASSERT_EQ(ran.size(), 1U);
  EXPECT_GE(ran[0], start + milliseconds(2));
}

TEST(LoopTest, TimersRunInTheOrderOfTheirDeadlines) {
  Loop loop;
  const TimePoint start = loop.now();
  std::string order;
  Timer third(loop, [&] {
    order += 'c';
    loop.stop();
  });
  Timer first(loop, [&] { order += 'a'; });
  Timer second(loop, [&] { order += 'b'; });
  third.set(start + milliseconds(3));
  first.set(start + milliseconds(1));
  second.set(start + milliseconds(2));
  loop.run();
  EXPECT_EQ(order, "abc");
}

TEST(LoopTest, ATimerMayBeSetAgainOrDestroyedByItsOwnCallback) {
  Loop loop;
  int num_calls = 0;
  std::optional<Timer> timer;
  timer.emplace(loop, [&] {
    if (++num_calls < 3) return timer->set(loop.now());
    timer.reset();
    loop.stop();
  });
  timer->set(loop.now());
  loop.run();
  EXPECT_EQ(num_calls, 3);
}

TEST(LoopTest, ATimerThatIsDueNeverRunsOnceItIsDestroyed) {
  Loop loop;
  const Pair pair;
  pair.write('x');
  std::optional<Timer> timer;
  timer.emplace(loop, [] { FAIL() << "it had been destroyed"; });
  timer->set(loop.now() - milliseconds(1));
  loop.watch(pair.reader(), [&] {
    pair.read();
    timer.reset();
    loop.after_ready_events([&] { loop.stop(); });
  });
  loop.run();
}

TEST(LoopTest, ATimerThatIsDueMayStillBeReplacedByAnEventBeforeIt) {
  Loop loop;
  const Pair pair;
  pair.write('x');
  Timer timer(loop, [] { FAIL() << "it had been replaced"; });
  timer.set(loop.now() - milliseconds(1));
  loop.watch(pair.reader(), [&] {
    pair.read();
    timer.set(TimePoint::max());
    loop.after_ready_events([&] { loop.stop(); });
  });
  loop.run();
}

TEST(LoopTest, ATimerAtTheEndOfTimeNeverRuns) {
  Loop loop;
  Timer timer(loop, [] { FAIL(); });
  timer.set(TimePoint::max());
  EXPECT_FALSE(timer.is_set());
  loop.after_ready_events([&] { loop.stop(); });
  loop.run();
}

TEST(LoopTest, ADescriptorIsReportedWhileItIsReadable) {
  Loop loop;
  const Pair pair;
  std::string read;
  pair.write('a');
  pair.write('b');
  pair.write('c');
  loop.watch(pair.reader(), [&] {
    read += pair.read();  // one byte at a time: the others must be reported again
    if (read.size() == 3) loop.stop();
  });
  loop.run();
  EXPECT_EQ(read, "abc");
}

TEST(LoopTest, ACallbackMayForgetItsOwnDescriptorAndOthers) {
  Loop loop;
  const Pair first;
  const Pair second;
  first.write('a');
  second.write('b');
  int num_calls = 0;
  const auto forget_both = [&] {
    ++num_calls;
    loop.forget(first.reader());
    loop.forget(second.reader());
    loop.after_ready_events([&] { loop.stop(); });
  };
  loop.watch(first.reader(), forget_both);
  loop.watch(second.reader(), forget_both);
  loop.run();
  EXPECT_EQ(num_calls, 1);
}

TEST(LoopTest, AForgottenDescriptorMayBeWatchedAgain) {
  Loop loop;
  const Pair pair;
  pair.write('a');
  loop.watch(pair.reader(), [] { FAIL(); });
  loop.forget(pair.reader());
  char read = 0;
  loop.watch(pair.reader(), [&] {
    read = pair.read();
    loop.stop();
  });
  loop.run();
  EXPECT_EQ(read, 'a');
}

TEST(LoopTest, AReportOfAForgottenDescriptorReachesNoOtherThatIsWatchedSince) {
  Loop loop;
  const Pair first;
  const Pair second;
  std::string read;
  const auto read_one_and_renew = [&](const Pair& mine, const Pair& other) {
    read += mine.read();
    loop.forget(other.reader());
    // It is ready, but the look that is under way has found another watch ready, not this one.
    loop.watch(other.reader(), [&] { read += 'n', loop.stop(); });
  };
  first.write('a');
  second.write('a');
  loop.watch(first.reader(), [&] { read_one_and_renew(first, second); });
  loop.watch(second.reader(), [&] { read_one_and_renew(second, first); });
  loop.run();
  EXPECT_EQ(read, "an");
}

TEST(LoopTest, AWatchedDescriptorStaysBlocking) {
  Loop loop;
  const Pair pair;
  pair.write('a');
  loop.watch(pair.reader(), [&] {
    if (pair.read() == 'b') loop.stop();
    EXPECT_EQ(fcntl(pair.reader(), F_GETFL) & O_NONBLOCK, 0);
    pair.write('b');
  });
  EXPECT_EQ(fcntl(pair.reader(), F_GETFL) & O_NONBLOCK, 0);
  loop.run();
}

TEST(LoopTest, WorkAfterReadyEventsSeesADrainedInbox) {
  Loop loop;
  std::array<Pair, 5> pairs;
  std::string order;
  for (const Pair& pair : pairs) pair.write('r');
  bool is_planned = false;
  for (const Pair& pair : pairs) {
    loop.watch(pair.reader(), [&] {
      order += pair.read();
      if (std::exchange(is_planned, true)) return;
      loop.after_ready_events([&] {
        order += 'd';
        loop.stop();
      });
    });
  }
  loop.run();
  EXPECT_EQ(order, "rrrrrd");
}

TEST(LoopTest, ASignalIsAnEventEachTimeItComes) {
  Loop loop;
  int num_signals = 0;
  loop.on_signals({SIGUSR1, SIGUSR2}, [&](int signal) {
    EXPECT_EQ(signal, num_signals == 0 ? SIGUSR1 : SIGUSR2);
    if (++num_signals == 2) loop.stop();
    raise(SIGUSR2);
  });
  raise(SIGUSR1);
  loop.run();
  EXPECT_EQ(num_signals, 2);
}

TEST(LoopTest, ASignalThatComesWhenTheLoopIsGoneEndsNobody) {
  EXPECT_EXIT(
      {
        {
          Loop().on_signals({SIGTERM}, [](int) {});
        }
        raise(SIGTERM);
        _exit(7);
      },
      testing::ExitedWithCode(7), "");
}

TEST(LoopTest, ATimerThatSetsItselfToThePastLeavesOthersTheirTurn) {
  Loop loop;
  const Pair pair;
  Timer restless(loop, [&] { restless.set(loop.now() - hours(1)); });
  restless.set(loop.now());
  loop.watch(pair.reader(), [&] { loop.stop(); });
  pair.write('x');
  loop.run();
}

TEST(LoopTest, RunsAgainAfterAStop) {
  Loop loop;
  int num_runs = 0;
  for (int i = 0; i < 3; ++i) {
    loop.after_ready_events([&] {
      ++num_runs;
      loop.stop();
    });
    loop.run();
  }
  EXPECT_EQ(num_runs, 3);
}

TEST(LoopTest, MayEndWithEverythingStillPending) {
  const Pair pair;
  Loop loop;
  Timer timer(loop, [] {});
  timer.set(loop.now() + hours(1));
  loop.on_signals({SIGUSR1}, [](int) {});
  loop.watch(pair.reader(), [] {});
  loop.after_ready_events([] {});
}

}  // namespace
}  // namespace treeroll::transport
