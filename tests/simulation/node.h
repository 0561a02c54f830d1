#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/protocol/messages.h"
#include "tests/simulation/schedule.h"

namespace treeroll::simulation {

/// A process in virtual time: an inbox that is read a moment after something has come, and work for
/// later, which is void if the process is gone and waits while it is stopped (SIGSTOP).
class Node {
 public:
  using MessagePointer = std::shared_ptr<const protocol::Message>;

  Node(Schedule& schedule, Duration reading_delay)
      : schedule_(schedule), reading_delay_(reading_delay) {}
  virtual ~Node() = default;
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void deliver(MessagePointer message) {
    inbox_.push_back(std::move(message));
    if (inbox_.size() > 1) return;
    later(reading_delay_, [this] { on_inbox(std::exchange(inbox_, {})); });
  }

  void stop_until(TimePoint time) { stopped_until_ = std::max(stopped_until_, time); }

 protected:
  void later(Duration delay, Schedule::Action action) {
    schedule_.after(delay, guarded(std::move(action)));
  }
  /// Calls on_timer() once `deadline` has come, unless told otherwise before.
  void wake_at(TimePoint deadline) {
    deadline_ = deadline;
    if (wake_ && *wake_ <= deadline) return;
    wake_ = deadline;
    schedule_.at(deadline, guarded([this, deadline] {
                   if (wake_ != deadline) return;
                   wake_.reset();
                   if (deadline_ > schedule_.now()) {
                     wake_at(deadline_);
                   } else {
                     on_timer();
                   }
                 }));
  }

  virtual void on_inbox(std::vector<MessagePointer> messages) = 0;
  virtual void on_timer() = 0;

  Schedule& schedule_;

 private:
  Schedule::Action guarded(Schedule::Action action) {
    return [this, life = std::weak_ptr(life_), action = std::move(action)] {
      if (life.expired()) return;
      if (schedule_.now() < stopped_until_) {
        schedule_.at(stopped_until_, guarded(action));
      } else {
        action();
      }
    };
  }

  Duration reading_delay_;
  std::vector<MessagePointer> inbox_;
  TimePoint stopped_until_{};
  TimePoint deadline_{};
  std::optional<TimePoint> wake_;
  std::shared_ptr<char> life_ = std::make_shared<char>();
};

}  // namespace treeroll::simulation
