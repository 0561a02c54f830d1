#include "common/transport/loop.h"

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "common/base/check.h"

namespace treeroll::transport {
namespace {

/// Descriptors reported in one look; the others come with the next, first.
constexpr std::size_t kReadyMax = 256;

std::string failure(const char* what) { return std::string(what) + ": " + std::strerror(errno); }

/// Closes at the end.
class Descriptor {
 public:
  Descriptor(int number, const char* what) : number_(number) { CHECK(number_ >= 0, failure(what)); }
  ~Descriptor() { close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return number_; }

 private:
  int number_;
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
  using Callback = std::function<void()>;
  using TimerState = std::shared_ptr<Timer::State>;
  struct Earlier {
    bool operator()(const TimerState& a, const TimerState& b) const {
      return std::pair(a->deadline, a->number) < std::pair(b->deadline, b->number);
    }
  };

  void turn();
  int look();
  void run_due_timers();

  Descriptor epoll{epoll_create1(EPOLL_CLOEXEC), "epoll_create1"};
  std::array<epoll_event, kReadyMax> ready{};
  /// By a number that names no other watch later: what one look has reported may be forgotten by
  /// a callback before its turn, and its descriptor may be watched anew.
  std::map<std::uint64_t, std::shared_ptr<Callback>> watches;
  std::map<int, std::uint64_t> watch_of;  // by descriptor
  std::vector<std::unique_ptr<Descriptor>> signals;
  std::set<TimerState, Earlier> timers;  // those that are set
  std::vector<Callback> after;
  std::uint64_t next_number = 1;
  bool is_stopped = false;
};

Loop::Loop() : implementation_(std::make_unique<Implementation>()) {}

Loop::~Loop() = default;

TimePoint Loop::now() const { return monotonic_now(); }

void Loop::run() {
  while (!implementation_->is_stopped) implementation_->turn();
  implementation_->is_stopped = false;
}

void Loop::stop() { implementation_->is_stopped = true; }

/// One look at the descriptors, then what it has shown, the timers, and what has waited for both.
void Loop::Implementation::turn() {
  const int num_ready = look();
  std::vector<Callback> waited = std::exchange(after, {});
  for (int i = 0; i < num_ready && !is_stopped; ++i) {
    const auto found = watches.find(ready[static_cast<std::size_t>(i)].data.u64);
    if (found == watches.end()) continue;
    const std::shared_ptr<Callback> callback = found->second;  // it may forget itself
    (*callback)();
  }
  run_due_timers();
  std::size_t num_done = 0;
  while (num_done < waited.size() && !is_stopped) waited[num_done++]();
  // After a stop the others wait for the next run.
  waited.erase(waited.begin(), waited.begin() + static_cast<std::ptrdiff_t>(num_done));
  after.insert(after.begin(), std::make_move_iterator(waited.begin()),
               std::make_move_iterator(waited.end()));
}

/// How many descriptors are ready. Waits for one, or for the first timer, unless work waits.
int Loop::Implementation::look() {
  timespec wait{};
  const bool waits_for_ever = after.empty() && timers.empty();
  if (after.empty() && !timers.empty()) {
    const Duration left = std::max((*timers.begin())->deadline - monotonic_now(), Duration{});
    const auto left_s = std::chrono::floor<std::chrono::seconds>(left);
    wait = {static_cast<time_t>(left_s.count()), static_cast<long>((left - left_s).count())};
  }
  const int count = epoll_pwait2(epoll.get(), ready.data(), static_cast<int>(ready.size()),
                                 waits_for_ever ? nullptr : &wait, nullptr);
  CHECK(count >= 0 || errno == EINTR, failure("epoll_pwait2"));
  return std::max(count, 0);
}

/// Each once at most, whatever it sets anew.
void Loop::Implementation::run_due_timers() {
  if (timers.empty()) return;
  const TimePoint now = monotonic_now();
  std::vector<TimerState> due;
  for (const TimerState& timer : timers) {
    if (timer->deadline > now) break;
    due.push_back(timer);
  }
  for (const TimerState& timer : due) {
    if (is_stopped) return;
    if (timer->deadline > now) continue;  // replaced, or gone, by an earlier one
    timers.erase(timer);
    timer->deadline = TimePoint::max();
    timer->on_due();
  }
}

void Loop::on_signals(const std::vector<int>& signals, std::function<void(int signal)> callback) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : signals) sigaddset(&set, signal);
  CHECK(sigprocmask(SIG_BLOCK, &set, nullptr) == 0, failure("sigprocmask"));
  implementation_->signals.push_back(
      std::make_unique<Descriptor>(signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK), "signalfd"));
  const int descriptor = implementation_->signals.back()->get();
  watch(descriptor, [descriptor, callback = std::move(callback)] {
    signalfd_siginfo signal{};
    if (read(descriptor, &signal, sizeof signal) == sizeof signal) {
      callback(static_cast<int>(signal.ssi_signo));
    }
  });
}

void Loop::watch(int descriptor, std::function<void()> callback) {
  const std::uint64_t number = implementation_->next_number++;
  const bool is_new = implementation_->watch_of.emplace(descriptor, number).second;
  CHECK(is_new, "a descriptor is watched twice");
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u64 = number;
  CHECK(epoll_ctl(implementation_->epoll.get(), EPOLL_CTL_ADD, descriptor, &event) == 0,
        failure("epoll_ctl"));
  implementation_->watches.emplace(number,
                                   std::make_shared<std::function<void()>>(std::move(callback)));
}

void Loop::forget(int descriptor) {
  const auto found = implementation_->watch_of.find(descriptor);
  CHECK(found != implementation_->watch_of.end(), "a descriptor is forgotten that is not watched");
  // Fails for one that liblcm has closed, which the kernel has forgotten then.
  epoll_ctl(implementation_->epoll.get(), EPOLL_CTL_DEL, descriptor, nullptr);
  implementation_->watches.erase(found->second);
  implementation_->watch_of.erase(found);
}

void Loop::after_ready_events(std::function<void()> callback) {
  implementation_->after.push_back(std::move(callback));
}

Timer::Timer(Loop& loop, std::function<void()> on_due)
    : state_(std::make_shared<State>(State{loop.implementation_.get(), std::move(on_due)})) {}

Timer::~Timer() { set(TimePoint::max()); }

void Timer::set(TimePoint deadline) {
  if (deadline == state_->deadline) return;
  if (is_set()) state_->loop->timers.erase(state_);
  state_->deadline = deadline;
  state_->number = state_->loop->next_number++;
  if (is_set()) state_->loop->timers.insert(state_);
}

bool Timer::is_set() const { return state_->deadline != TimePoint::max(); }

}  // namespace treeroll::transport
