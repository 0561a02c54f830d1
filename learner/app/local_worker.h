#pragma once

#include <sys/types.h>

#include <optional>

#include "common/base/time.h"
#include "learner/app/options.h"

namespace treeroll {

/// The worker daemon a learner starts for itself (`--local-workers N`: N evaluators). It is started
/// again when it dies, ever more seldom if it dies again and again, and ends with the learner,
/// however that ends.
class LocalWorker {
 public:
  /// Throws std::runtime_error if the worker executable cannot be started.
  LocalWorker(const LearnerOptions& options, TimePoint now);
  /// Asks it to drain and end; kills it if it does not.
  ~LocalWorker();
  LocalWorker(const LocalWorker&) = delete;
  LocalWorker& operator=(const LocalWorker&) = delete;

  /// Looks whether it has died and whether to start it again; to be called on SIGCHLD and at
  /// next_start(). Does not throw.
  void watch(TimePoint now);
  /// TimePoint::max() while it runs.
  TimePoint next_start() const { return start_at_.value_or(TimePoint::max()); }

 private:
  bool start(TimePoint now);
  void note_end(int wait_status, TimePoint now);

  const LearnerOptions& options_;
  pid_t child_ = -1;
  TimePoint started_at_;
  std::optional<TimePoint> start_at_;  ///< while it does not run
  int num_quick_ends_ = 0;             ///< in a row
};

}  // namespace treeroll
