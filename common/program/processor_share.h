#pragma once

#include <filesystem>

namespace treeroll {

/// As many processors as this process may keep busy, at least 1: those it is bound to
/// (sched_setaffinity), or less where a cgroup, a container's say, limits their time.
int num_usable_processors();

/// The limit of the cgroups a process is in and of all above them, version 2 (cpu.max) and 1
/// (cpu.cfs_quota_us over cpu.cfs_period_us), in processors; infinite if none limits it.
/// @param membership  /proc/PID/cgroup
/// @param mount       /sys/fs/cgroup
double cgroup_processors(const std::filesystem::path& membership,
                         const std::filesystem::path& mount);

}  // namespace treeroll
