#include "learner/app/local_worker.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/program/log.h"
#include "common/protocol/timings.h"
#include "learner/worker_program/process.h"

namespace treeroll {
namespace {

/// A worker that ends so soon may do so again: it is started again later each time.
constexpr Duration kQuickEnd = std::chrono::seconds(2);
constexpr Duration kPauseMin = std::chrono::seconds(1);
constexpr Duration kPauseMax = std::chrono::seconds(30);

}  // namespace

LocalWorker::LocalWorker(const LearnerOptions& options, TimePoint now) : options_(options) {
  if (!start(now)) throw std::runtime_error("the local worker cannot be started");
}

LocalWorker::~LocalWorker() {
  if (child_ > 0)
    end_child(child_,
              std::chrono::duration_cast<std::chrono::milliseconds>(protocol::kLocalWorkerGrace));
}

bool LocalWorker::start(TimePoint now) {
  start_at_.reset();
  started_at_ = now;
  std::vector<std::string> arguments = {"--processes", fmt::format("{}", options_.local_workers),
                                        "--lcm-url", options_.lcm_url};
  if (!options_.key_file.empty()) {
    arguments.insert(arguments.end(), {"--key-file", options_.key_file.string()});
  }
  // A worker executable of an earlier version knows no such option.
  if (logs_as_json()) arguments.insert(arguments.end(), {"--log", "json"});
  Result<pid_t> child =
      start_child(options_.worker_program.path, options_.worker_program.arguments(arguments));
  if (!child) {
    spdlog::error("{}: {}", options_.worker_program.path.string(), child.error().message);
    return false;
  }
  child_ = *child;
  return true;
}

void LocalWorker::watch(TimePoint now) {
  int wait_status = 0;
  if (child_ > 0 && waitpid(child_, &wait_status, WNOHANG) == child_) note_end(wait_status, now);
  if (start_at_ && now >= *start_at_ && !start(now)) start_at_ = now + kPauseMax;
}

void LocalWorker::note_end(int wait_status, TimePoint now) {
  child_ = -1;
  num_quick_ends_ = now - started_at_ < kQuickEnd ? num_quick_ends_ + 1 : 0;
  const Duration pause =
      num_quick_ends_ == 0
          ? Duration{}
          : std::min(kPauseMin * (1 << std::min(num_quick_ends_ - 1, 10)), kPauseMax);
  start_at_ = now + pause;
  const std::string how = WIFSIGNALED(wait_status)
                              ? fmt::format("signal {}", WTERMSIG(wait_status))
                              : fmt::format("status {}", WEXITSTATUS(wait_status));
  spdlog::warn("the local worker ended with {}: it is started again in {:.0f} s", how,
               to_seconds(pause));
}

}  // namespace treeroll
