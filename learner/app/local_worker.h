#pragma once

#include <sys/types.h>

#include <chrono>

#include "learner/app/options.h"

namespace treeroll {

/// The worker daemon a learner starts for itself (`--local-workers N`: N evaluators). It is started
/// again when it dies, and ends with the learner, however that ends.
class LocalWorker {
 public:
  /// Throws std::runtime_error if the worker executable cannot be started.
  explicit LocalWorker(const LearnerOptions& options);
  /// Asks it to drain and end; kills it if it does not.
  ~LocalWorker();
  LocalWorker(const LocalWorker&) = delete;
  LocalWorker& operator=(const LocalWorker&) = delete;

  /// To be called on SIGCHLD. Does not throw.
  void on_child_ended();

 private:
  bool start();

  const LearnerOptions& options_;
  pid_t child_ = -1;
  std::chrono::steady_clock::time_point started_at_;
  int num_quick_ends_ = 0;
};

}  // namespace treeroll
