#include "common/transport/loop.h"

#include <fcntl.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <list>
#include <map>
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

}  // namespace

struct Loop::Implementation {
  // One thread: Asio need not lock.
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> work{context.get_executor()};
  std::list<Signals> signals;
  std::map<int, std::shared_ptr<Watch>> watches;
};

Loop::Loop() : implementation_(std::make_unique<Implementation>()) {}

Loop::~Loop() {
  for (auto& [number, watch] : implementation_->watches) watch->forget();
}

TimePoint Loop::now() const {
  return TimePoint(
      std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

void Loop::run() {
  implementation_->context.run();
  implementation_->context.restart();
}

asio::io_context& Loop::context() { return implementation_->context; }

void Loop::stop() { implementation_->context.stop(); }

void Loop::on_signals(const std::vector<int>& signals, std::function<void(int signal)> callback) {
  Signals& entry = implementation_->signals.emplace_back(implementation_->context);
  for (const int signal : signals) entry.set.add(signal);
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

/// Handlers of Asio hold it too, so that a callback may destroy its own timer.
struct Timer::State {
  asio::steady_timer timer;
  std::function<void()> on_due;
  TimePoint deadline = TimePoint::max();
  std::uint64_t generation = 0;
};

Timer::Timer(Loop& loop, std::function<void()> on_due)
    : state_(std::make_shared<State>(
          State{asio::steady_timer(loop.implementation_->context), std::move(on_due)})) {}

Timer::~Timer() { set(TimePoint::max()); }

void Timer::set(TimePoint deadline) {
  if (deadline == state_->deadline) return;
  state_->deadline = deadline;
  // Cancelling is too late for a handler that is queued already: it sees its generation is over.
  const std::uint64_t generation = ++state_->generation;
  state_->timer.cancel();
  if (deadline == TimePoint::max()) return;
  state_->timer.expires_at(std::chrono::steady_clock::time_point(deadline.time_since_epoch()));
  state_->timer.async_wait([state = state_, generation](const error_code& error) {
    if (error || generation != state->generation) return;
    state->deadline = TimePoint::max();
    state->on_due();
  });
}

bool Timer::is_set() const { return state_->deadline != TimePoint::max(); }

}  // namespace treeroll::transport
