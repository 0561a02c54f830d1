#include "learner/app/local_worker.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <stdexcept>

#include "learner/app/process.h"

namespace treeroll {
namespace {

/// A worker that ends so soon and so often cannot work here: starting it again would only spin.
constexpr std::chrono::seconds kQuickEnd{2};
constexpr int kQuickEndsMax = 3;
constexpr std::chrono::milliseconds kGrace{3000};

}  // namespace

LocalWorker::LocalWorker(const LearnerOptions& options) : options_(options) {
  if (!start()) throw std::runtime_error("the local worker cannot be started");
}

LocalWorker::~LocalWorker() {
  if (child_ > 0) end_child(child_, kGrace);
}

bool LocalWorker::start() {
  Result<pid_t> child = start_child(
      options_.worker_program,
      {"--processes", fmt::format("{}", options_.local_workers), "--lcm-url", options_.lcm_url});
  if (!child) {
    spdlog::error("{}: {}", options_.worker_program.string(), child.error().message);
    child_ = -1;
    return false;
  }
  child_ = *child;
  started_at_ = std::chrono::steady_clock::now();
  return true;
}

void LocalWorker::on_child_ended() {
  int status = 0;
  if (child_ <= 0 || waitpid(child_, &status, WNOHANG) != child_) return;
  child_ = -1;
  const bool quick = std::chrono::steady_clock::now() - started_at_ < kQuickEnd;
  num_quick_ends_ = quick ? num_quick_ends_ + 1 : 0;
  const std::string how = WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status))
                                              : fmt::format("status {}", WEXITSTATUS(status));
  if (num_quick_ends_ >= kQuickEndsMax) {
    spdlog::error("the local worker ended at once {} times, last with {}: it is not started again",
                  num_quick_ends_, how);
    return;
  }
  spdlog::warn("the local worker ended with {}: it is started again", how);
  start();
}

}  // namespace treeroll
