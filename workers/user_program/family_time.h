#pragma once

#include <sys/types.h>

#include <optional>

#include "common/base/time.h"

namespace treeroll::worker {

/// CPU time of a process, all threads; nothing if it is gone.
std::optional<Duration> cpu_time_of(pid_t pid);

/// The same with that of all processes it has started, and they, and so on, those that have ended
/// and been waited for too (these to 10 ms): a user's program may leave the work to others.
Duration cpu_time_of_family(pid_t pid);

}  // namespace treeroll::worker
