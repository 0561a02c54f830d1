#include "learner/app/progress_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/base/for_log.h"
#include "common/base/shown_reward.h"

namespace treeroll {
namespace {

/// Between two lines: often at first, once a minute after ten minutes, so that a study of days fits
/// a screen. One that is held in place is drawn whenever it changes.
Duration period(bool in_place, double elapsed_s) {
  if (in_place) return {};
  const double seconds = std::clamp(elapsed_s / 10, 2., 60.);
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

constexpr Duration kWarningPeriod = std::chrono::seconds(5);

double share_of(std::int64_t num_done, std::int64_t num_in_all) {
  return num_in_all > 0 ? static_cast<double>(num_done) / static_cast<double>(num_in_all) : 0;
}

std::string bar(double share) {
  constexpr int kWidth = 20;
  const auto full = static_cast<std::size_t>(std::clamp(share, 0., 1.) * kWidth);
  return "[" + std::string(full, '#') + std::string(kWidth - full, '.') + "] ";
}

std::string as_time(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

/// "; 12 failed, 3 discarded, the last failure: run 0 (tree, repetition 0), roll-out 7: diverged".
std::string failures(const protocol::LearnerStatus& status) {
  std::vector<std::string> said;
  if (status.num_failed > 0) said.push_back(fmt::format("{} failed", status.num_failed));
  if (status.num_discarded > 0) said.push_back(fmt::format("{} discarded", status.num_discarded));
  if (!status.last_failure.empty())
    said.push_back("the last failure: " + for_log(status.last_failure));
  return said.empty() ? "" : fmt::format("; {}", fmt::join(said, ", "));
}

std::string as_rate(double per_s) {
  if (per_s >= 1) return fmt::format("{:.0f} roll-outs/s", per_s);
  if (per_s >= 1. / 60) return fmt::format("{:.1f} roll-outs/min", 60 * per_s);
  return fmt::format("{:.1f} roll-outs/h", 3600 * per_s);
}

}  // namespace

std::string how_far(const protocol::LearnerStatus& status) {
  const std::int64_t num_done = status.num_applied + status.num_evaluated;
  const std::int64_t num_in_all = status.num_rollouts + status.num_evaluations;
  return fmt::format(
      "{} of {} roll-outs ({:.0f} %), {} of {} runs done, {}; {} workers with {} evaluators",
      num_done, num_in_all, 100. * share_of(num_done, num_in_all), status.num_runs_done,
      status.num_runs,
      status.best_reward > 0 ? "best " + shown_reward(status.best_reward)
                             : "no positive reward yet",
      status.num_workers, status.num_evaluators);
}

ProgressLine::ProgressLine(bool operator_is_here)
    : in_place_(has_status_line() && !operator_is_here),
      is_quiet_(has_status_line() && operator_is_here) {}

ProgressLine::~ProgressLine() {
  if (in_place_) show_status_line("");
}

void ProgressLine::show(const protocol::LearnerStatus& status, TimePoint now) {
  if (!status.waiting_for.empty() && (!last_warned_ || now - *last_warned_ >= kWarningPeriod)) {
    log_.add(now, LogLine::Level::kWarning, "waiting",
             fmt::format("waiting: {}", for_log(status.waiting_for)));
    last_warned_ = now;
  }
  if (!last_shown_) {
    last_shown_ = now;
    return;
  }
  const std::int64_t num_done = status.num_applied + status.num_evaluated;
  const std::int64_t num_in_all = status.num_rollouts + status.num_evaluations;
  pace_.note(now, num_done, status.num_evaluators);
  if (is_quiet_ || now - *last_shown_ < period(in_place_, status.elapsed_s)) return;
  last_shown_ = now;
  const std::string failed = failures(status);
  if (num_done == 0 && failed.empty()) return;  // the warning above says why
  const std::string text = how_far(status) + pace(num_in_all - num_done) + failed;
  if (in_place_) return show_status_line(bar(share_of(num_done, num_in_all)) + text);
  spdlog::info("{}", text);
}

/// ", 313 roll-outs/s, 13 s left"; nothing while that is not known.
std::string ProgressLine::pace(std::int64_t num_left) const {
  const std::optional<double> per_s = pace_.per_s();
  if (!per_s || *per_s <= 0) return "";
  return fmt::format(", {}, {} left", as_rate(*per_s),
                     as_time(static_cast<double>(num_left) / *per_s));
}

void ProgressLine::show(const transport::BusStatistics& bus, TimePoint now) {
  if (bus.num_rejected > shown_bus_.num_rejected) {
    log_.add(now, LogLine::Level::kWarning, "refusals of datagrams",
             fmt::format("{} datagrams refused so far, the last: {}", bus.num_rejected,
                         bus.last_rejection));
  }
  if (bus.num_unsent > shown_bus_.num_unsent) {
    log_.add(now, LogLine::Level::kWarning, "failures to send",
             fmt::format("{} messages not sent so far, the last: {}", bus.num_unsent,
                         bus.last_publish_error));
  }
  if (bus.num_replayed > shown_bus_.num_replayed) {
    log_.add(now, LogLine::Level::kWarning, "messages that come twice",
             fmt::format("{} signed messages came a second time, or late, and were refused: the "
                         "network doubles or delays them, or somebody plays a recording",
                         bus.num_replayed));
  }
  if (!bus.key_file_error.empty() && bus.key_file_error != shown_bus_.key_file_error) {
    log_.add(now, LogLine::Level::kError, "key files that are not used",
             fmt::format("the keys stay as they were: {}", bus.key_file_error));
  }
  shown_bus_ = bus;
}

}  // namespace treeroll
