#pragma once

namespace treeroll::worker {

/// What a task does to this process leaves no core dump: a task that hangs or crashes is no bug of
/// ours, and a roll-out that crashes does it three times.
void turn_off_core_dumps();

/// The kernel ends this process by SIGXCPU once it has used `limit_s` more of processor time,
/// rounded up to seconds.
void limit_cpu_time(double limit_s);

}  // namespace treeroll::worker
