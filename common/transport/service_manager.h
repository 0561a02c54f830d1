#pragma once

#include <string>

#include "common/transport/loop.h"

namespace treeroll::transport {

/// What a service manager (systemd) is told by a daemon that it has started, with sd_notify(3):
/// that it serves, how far it is, and again and again that its loop turns. A loop that hangs is
/// ended and started again by the manager. Without a manager all of this does nothing.
class ServiceManager {
 public:
  /// Nothing is said before say_ready(): a first sign of life would start the manager's watch, and
  /// what comes before (a long journal is read) has no turns of the loop.
  explicit ServiceManager(Loop& loop);

  /// It serves now, or learns; `systemctl start` waits for this. From now on signs of life come
  /// with the loop's turns, three in each WatchdogSec of the unit.
  void say_ready();
  void say_stopping();
  /// What follows may take so long without a turn of the loop, also while it is being stopped.
  void say_busy_for(std::chrono::hours time);
  /// A line for `systemctl status`; the same one again is not sent.
  void say_status(const std::string& line);

 private:
  void give_sign_of_life();

  Loop& loop_;
  Duration period_{};  ///< 0: no sign is asked for
  bool is_there_ = false;
  std::string status_;
  Timer timer_{loop_, [this] { give_sign_of_life(); }};
};

}  // namespace treeroll::transport
