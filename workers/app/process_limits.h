#pragma once

#include <cstdint>

namespace treeroll::worker {

/// What a task does to this process leaves no core dump: a task that hangs or crashes is no bug of
/// ours, and a roll-out that crashes does it three times.
void turn_off_core_dumps();

/// The kernel ends this process by SIGXCPU once it has used `limit_s` more of processor time,
/// rounded up to seconds.
void limit_cpu_time(double limit_s);

/// This process and those it starts may hold so much data each (RLIMIT_DATA): past it an allocation
/// fails.
void limit_memory(std::uint64_t bytes_max);

/// Ends this process as another one has ended, so that who watches it sees that one's end.
/// @param exited  with status `code` (0 counts as 1), else by signal `code`
[[noreturn]] void end_likewise(bool exited, int code);

}  // namespace treeroll::worker
