#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/program/log.h"
#include "common/protocol/messages.h"
#include "common/transport/bus.h"
#include "common/transport/bus_trouble.h"
#include "common/transport/loop.h"
#include "common/transport/service_manager.h"
#include "workers/relay/relay_core.h"

namespace treeroll::relay {

/// Of both sides; nothing: nothing is signed there.
struct RelayKeys {
  std::optional<transport::KeyFile> above;
  std::optional<transport::KeyFile> below;
};

/// Carries a relay core's effects out and its events in: two buses, the clock, the signals and the
/// log. One thread, the loop's.
class RelayDaemon {
 public:
  /// Opens both buses. Fails with one line for a person; nothing has been sent then. Throws
  /// ConfigError if they are one group or server.
  static Result<std::unique_ptr<RelayDaemon>> open(const std::string& url_above,
                                                   const std::string& url_below,
                                                   RelaySettings settings, RelayKeys keys);
  RelayDaemon(const RelayDaemon&) = delete;
  RelayDaemon& operator=(const RelayDaemon&) = delete;

  /// Serves until drained. @return exit status
  int run();

 private:
  RelayDaemon() = default;

  void step(const Event& event);
  void receive(const Event& event);
  void perform(const SendAbove& effect);
  void perform(const SendBelow& effect) { below_->publish(effect.message); }
  void perform(const LogLine& line) { log_line(line); }
  void perform(const Exit& effect);

  transport::Loop loop_;
  transport::ServiceManager manager_{loop_};
  transport::Timer timer_{loop_, [this] { step(TimerFired{}); }};
  std::unique_ptr<transport::Bus> above_;
  std::unique_ptr<transport::Bus> below_;
  std::optional<RelayCore> core_;
  bool drain_is_due_ = false;  ///< of the inboxes
  std::optional<int> exit_status_;
  transport::BusTrouble trouble_above_;
  transport::BusTrouble trouble_below_;
};

}  // namespace treeroll::relay
