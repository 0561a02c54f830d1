#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/base/time.h"

namespace boost::asio {
class io_context;
}

namespace treeroll::transport {

/// The event loop of a daemon: one thread, timers, descriptors and signals (Boost.Asio behind it,
/// kept out of this header). Callbacks run one at a time inside run() and must not throw.
class Loop {
 public:
  Loop();
  ~Loop();
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  /// Monotonic time; the only clock a daemon hands to its core.
  TimePoint now() const;

  /// Runs until stop(); may be run again.
  void run();
  void stop();

  /// Runs `callback` on each of these signals instead of their default action. They are blocked
  /// once the loop is gone: who has ended in order is not ended by a late one.
  void on_signals(const std::vector<int>& signals, std::function<void(int signal)> callback);
  /// Runs `callback` once a turn while `descriptor` is readable, until forget(descriptor). The loop
  /// does not own the descriptor; forget it before closing it.
  void watch(int descriptor, std::function<void()> callback);
  void forget(int descriptor);
  /// Runs `callback` after the events that are ready now and those that one more look finds: used
  /// to act once on a drained inbox.
  void after_ready_events(std::function<void()> callback);

  /// For what Asio alone can do in this loop: learner/web accepts connections.
  boost::asio::io_context& context();

 private:
  friend class Timer;
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// One deadline in a loop, which must outlive it. A daemon has one for each thing it waits for.
class Timer {
 public:
  /// @param on_due  runs once for each deadline that comes; may set the timer again or destroy it
  Timer(Loop& loop, std::function<void()> on_due);
  ~Timer();
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  /// Replaces the deadline that was set before; TimePoint::max() is never.
  void set(TimePoint deadline);
  /// A deadline is to come.
  bool is_set() const;

 private:
  friend class Loop;
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace treeroll::transport
