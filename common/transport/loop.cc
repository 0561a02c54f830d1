#include "common/transport/loop.h"

#include <fcntl.h>

#include <algorithm>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <cstdint>
#include <list>
#include <map>
#include <set>
#include <utility>

#include "common/base/check.h"

namespace treeroll::transport {
namespace asio = boost::asio;
using boost::system::error_code;

namespace {

/// One watched descriptor. Handlers of Asio hold it too, so that a callback may forget any
/// descriptor, its own included.
struct Watch : std::enable_shared_from_this<Watch> {
  Watch(asio::io_context& context, int number, std::function<void()> on_readable)
      : descriptor(context, number), callback(std::move(on_readable)) {}

  void wait() {
    descriptor.async_wait(asio::posix::stream_descriptor::wait_read,
                          [self = shared_from_this()](const error_code& error) {
                            if (self->forgotten) return;
                            CHECK(!error, "waiting for a descriptor failed: " + error.message());
                            self->callback();
                            if (!self->forgotten) self->wait();
                          });
  }
  void forget() {
    forgotten = true;
    descriptor.release();  // it is the caller's to close
  }

  asio::posix::stream_descriptor descriptor;
  std::function<void()> callback;
  bool forgotten = false;
};

struct Signals {
  explicit Signals(asio::io_context& context) : set(context) {}

  void wait() {
    set.async_wait([this](const error_code& error, int signal) {
      if (error) return;  // cancelled: the loop is being destroyed
      callback(signal);
      wait();
    });
  }

  asio::signal_set set;
  std::function<void(int)> callback;
};

TimePoint monotonic_now() {
  return TimePoint(
      std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

}  // namespace

struct Timer::State {
  Loop::Implementation* loop = nullptr;
  std::function<void()> on_due;
  TimePoint deadline = TimePoint::max();
  std::uint64_t number = 0;  ///< of two with one deadline the one that was set first is first
};

struct Loop::Implementation {
  using TimerState = std::shared_ptr<Timer::State>;
  struct Earlier {
    bool operator()(const TimerState& a, const TimerState& b) const {
      return std::pair(a->deadline, a->number) < std::pair(b->deadline, b->number);
    }
  };

  void add(const TimerState& timer);
  void wake_by(TimePoint deadline);
  void run_due_timers();

  // One thread: Asio need not lock.
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  std::list<Signals> signals;
  sigset_t all_signals{};
  std::map<int, std::shared_ptr<Watch>> watches;
  std::set<TimerState, Earlier> timers;  // those that are set
  std::uint64_t next_number = 1;
  // Rings for all timers. Deadlines mostly move on: one that has become later leaves the alarm as
  // it is, which costs no system call, and is looked at again when it rings.
  asio::steady_timer alarm{context};
  TimePoint rings_at = TimePoint::max();
};

void Loop::Implementation::add(const TimerState& timer) {
  timer->number = next_number++;
  timers.insert(timer);
  wake_by(timer->deadline);
}

void Loop::Implementation::wake_by(TimePoint deadline) {
  if (deadline >= rings_at) return;
  rings_at = deadline;
  alarm.expires_at(std::chrono::steady_clock::time_point(deadline.time_since_epoch()));
  alarm.async_wait([this](const error_code& error) {
    if (error) return;  // set anew
    rings_at = TimePoint::max();
    run_due_timers();
  });
}

/// Each once at most, whatever it sets anew.
void Loop::Implementation::run_due_timers() {
  const TimePoint now = monotonic_now();
  std::vector<TimerState> due;
  for (const TimerState& timer : timers) {
    if (timer->deadline > now) break;
    due.push_back(timer);
  }
  for (const TimerState& timer : due) {
    if (context.stopped()) break;
    if (timer->deadline > now) continue;  // replaced, or gone, by an earlier one
    timers.erase(timer);
    timer->deadline = TimePoint::max();
    timer->on_due();
  }
  if (!timers.empty()) wake_by((*timers.begin())->deadline);
}

Loop::Loop() : implementation_(std::make_unique<Implementation>()) {
  sigemptyset(&implementation_->all_signals);
}

Loop::~Loop() {
  // Asio gives the signals up, whose default action would then end a process that is done.
  CHECK(sigprocmask(SIG_BLOCK, &implementation_->all_signals, nullptr) == 0, "sigprocmask");
  for (auto& [number, watch] : implementation_->watches) watch->forget();
}

TimePoint Loop::now() const { return monotonic_now(); }

void Loop::run() {
  implementation_->context.run();
  implementation_->context.restart();
}

asio::io_context& Loop::context() { return implementation_->context; }

void Loop::stop() { implementation_->context.stop(); }

void Loop::on_signals(const std::vector<int>& signals, std::function<void(int signal)> callback) {
  Signals& entry = implementation_->signals.emplace_back(implementation_->context);
  for (const int signal : signals) {
    entry.set.add(signal);
    sigaddset(&implementation_->all_signals, signal);
  }
  entry.callback = std::move(callback);
  entry.wait();
}

void Loop::watch(int descriptor, std::function<void()> callback) {
  auto watch = std::make_shared<Watch>(implementation_->context, descriptor, std::move(callback));
  const bool is_new = implementation_->watches.emplace(descriptor, watch).second;
  CHECK(is_new, "a descriptor is watched twice");
  // Asio makes what it waits for non-blocking, once. It reads nothing here, and liblcm's tcpq takes
  // a message that has come only in part for a lost connection.
  const int flags = fcntl(descriptor, F_GETFL);
  watch->wait();
  CHECK(fcntl(descriptor, F_SETFL, flags) == 0, "F_SETFL");
}

void Loop::forget(int descriptor) {
  const auto found = implementation_->watches.find(descriptor);
  CHECK(found != implementation_->watches.end(), "a descriptor is forgotten that is not watched");
  found->second->forget();
  implementation_->watches.erase(found);
}

void Loop::after_ready_events(std::function<void()> callback) {
  // The first hop runs after what is queued, the second after one more look at the descriptors.
  asio::post(implementation_->context, [this, callback = std::move(callback)]() mutable {
    asio::post(implementation_->context, std::move(callback));
  });
}

Timer::Timer(Loop& loop, std::function<void()> on_due)
    : state_(std::make_shared<State>(State{loop.implementation_.get(), std::move(on_due)})) {}

Timer::~Timer() { set(TimePoint::max()); }

void Timer::set(TimePoint deadline) {
  if (deadline == state_->deadline) return;
  if (is_set()) state_->loop->timers.erase(state_);
  state_->deadline = deadline;
  if (is_set()) state_->loop->add(state_);
}

bool Timer::is_set() const { return state_->deadline != TimePoint::max(); }

}  // namespace treeroll::transport
