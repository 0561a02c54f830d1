#include "learner/app/progress_line.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/base/shown_reward.h"

namespace treeroll {
namespace {

/// Often at first, once a minute after ten minutes: a study of days fits a screen.
Duration period(double elapsed_s) {
  const double seconds = std::clamp(elapsed_s / 10, 2., 60.);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

constexpr Duration kWarningPeriod = std::chrono::seconds(5);

std::string as_time(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

/// ", 12 failed, 3 discarded, the last: run 0 (tree, repetition 0), roll-out 7: diverged".
std::string failures(const protocol::LearnerStatus& status) {
  std::string text;
  if (status.num_failed > 0) text += fmt::format(", {} failed", status.num_failed);
  if (status.num_discarded > 0) text += fmt::format(", {} discarded", status.num_discarded);
  if (!status.last_failure.empty()) text += fmt::format(" (the last: {})", status.last_failure);
  return text;
}

}  // namespace

void ProgressLine::show(const protocol::LearnerStatus& status, TimePoint now) {
  if (!status.waiting_for.empty() && (!last_warned_ || now - *last_warned_ >= kWarningPeriod)) {
    warn(now, "waiting", fmt::format("waiting: {}", status.waiting_for));
    last_warned_ = now;
  }
  if (!last_shown_) {
    last_shown_ = now;
    return;
  }
  if (now - *last_shown_ < period(status.elapsed_s)) return;
  const double rate =
      static_cast<double>(status.num_applied - shown_applied_) / to_seconds(now - *last_shown_);
  rate_ = shown_applied_ == 0 ? rate : rate_ + .3 * (rate - rate_);
  last_shown_ = now;
  shown_applied_ = status.num_applied;
  if (status.num_applied == 0) return;  // the warning above says why
  const auto left = static_cast<double>(status.num_rollouts - status.num_applied);
  spdlog::info(
      "{} of {} roll-outs ({:.0f} %), {} of {} runs done, {}{}; {} workers with {} evaluators, "
      "{:.0f} roll-outs/s, {} left",
      status.num_applied, status.num_rollouts,
      100. * static_cast<double>(status.num_applied) / static_cast<double>(status.num_rollouts),
      status.num_runs_done, status.num_runs,
      status.best_reward > 0 ? "best " + shown_reward(status.best_reward)
                             : "no positive reward yet",
      failures(status), status.num_workers, status.num_evaluators, rate_,
      rate_ > 0 ? as_time(left / rate_) : "an unknown time");
}

void ProgressLine::show(const transport::BusStatistics& bus, TimePoint now) {
  if (bus.num_rejected > shown_bus_.num_rejected) {
    warn(now, "refusals of datagrams",
         fmt::format("{} datagrams refused so far, the last: {}", bus.num_rejected,
                     bus.last_rejection));
  }
  if (bus.num_unsent > shown_bus_.num_unsent) {
    warn(now, "failures to send",
         fmt::format("{} messages not sent so far, the last: {}", bus.num_unsent,
                     bus.last_publish_error));
  }
  shown_bus_ = bus;
}

void ProgressLine::warn(TimePoint now, std::string_view kind, std::string text) {
  std::vector<LogLine> lines;
  limiter_.add(now, {LogLine::Level::kWarning, kind, std::move(text)}, lines);
  for (const LogLine& line : lines) spdlog::warn("{}", line.text);
}

}  // namespace treeroll
