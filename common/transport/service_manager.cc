#include "common/transport/service_manager.h"

#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace treeroll::transport {
namespace {

constexpr int kSignsInPeriod = 3;

/// What a daemon has started in turn (a learner its local worker) inherits the environment, and is
/// not whom the manager listens to.
bool is_meant() {
  const char* pid = std::getenv("WATCHDOG_PID");
  return std::getenv("NOTIFY_SOCKET") != nullptr &&
         (pid == nullptr || std::string_view(pid) == std::to_string(getpid()));
}

}  // namespace

ServiceManager::ServiceManager(Loop& loop) : loop_(loop), is_there_(is_meant()) {
  std::uint64_t watchdog_us = 0;
  if (is_there_ && sd_watchdog_enabled(0, &watchdog_us) > 0) {
    period_ = std::chrono::microseconds(watchdog_us / kSignsInPeriod);
  }
}

void ServiceManager::say_ready() {
  if (is_there_) sd_notify(0, "READY=1");
  if (period_ > Duration::zero()) give_sign_of_life();
}

void ServiceManager::say_stopping() {
  if (is_there_) sd_notify(0, "STOPPING=1");
}

void ServiceManager::say_busy_for(std::chrono::hours time) {
  if (!is_there_) return;
  const auto time_us = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
  sd_notifyf(0, "WATCHDOG_USEC=%lld\nEXTEND_TIMEOUT_USEC=%lld", static_cast<long long>(time_us),
             static_cast<long long>(time_us));
}

void ServiceManager::say_status(const std::string& line) {
  if (!is_there_ || line == status_) return;
  status_ = line;
  sd_notify(0, ("STATUS=" + line).c_str());
}

void ServiceManager::give_sign_of_life() {
  sd_notify(0, "WATCHDOG=1");
  timer_.set(loop_.now() + period_);
}

}  // namespace treeroll::transport
