#include "common/transport/loop.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <string>

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
  TimePoint ran;
  loop.set_timer(deadline, [&] {
    ran = loop.now();
    loop.stop();
  });
  loop.run();
  EXPECT_GE(ran, deadline);
}

TEST(LoopTest, ALaterCallReplacesTheTimer) {
  Loop loop;
  std::string order;
  loop.set_timer(loop.now(), [&] { order += 'a'; });
  loop.set_timer(loop.now() + milliseconds(2), [&] {
    order += 'b';
    loop.stop();
  });
  loop.run();
  EXPECT_EQ(order, "b");
}

TEST(LoopTest, ATimerThatIsDueMayStillBeReplacedByAnEventBeforeIt) {
  Loop loop;
  const Pair pair;
  pair.write('x');
  loop.set_timer(loop.now() - milliseconds(1), [] { FAIL() << "it had been replaced"; });
  loop.watch(pair.reader(), [&] {
    pair.read();
    loop.set_timer(TimePoint::max(), [] {});
    loop.after_ready_events([&] { loop.stop(); });
  });
  loop.run();
}

TEST(LoopTest, ATimerAtTheEndOfTimeNeverRuns) {
  Loop loop;
  loop.set_timer(TimePoint::max(), [] { FAIL(); });
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
  loop.set_timer(loop.now() + hours(1), [] {});
  loop.on_signals({SIGUSR1}, [](int) {});
  loop.watch(pair.reader(), [] {});
  loop.after_ready_events([] {});
}

}  // namespace
}  // namespace treeroll::transport
