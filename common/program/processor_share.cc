#include "common/program/processor_share.h"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Numbers of files that may be missing or say "max" or -1.
double share(double quota_us, double period_us) {
  return quota_us > 0 && period_us > 0 ? quota_us / period_us : kUnlimited;
}

double limit_v2(const fs::path& group) {
  double quota_us = -1, period_us = -1;
  std::ifstream(group / "cpu.max") >> quota_us >> period_us;
  return share(quota_us, period_us);
}

double limit_v1(const fs::path& group) {
  double quota_us = -1, period_us = -1;
  std::ifstream(group / "cpu.cfs_quota_us") >> quota_us;
  std::ifstream(group / "cpu.cfs_period_us") >> period_us;
  return share(quota_us, period_us);
}

/// The least of a group and all above it up to the mount. In a container the path may name a group
/// of the host that is not seen here: the mount itself is then its group.
double least(const fs::path& mount, std::string path, double (*limit)(const fs::path&)) {
  double processors = limit(mount);
  while (!path.empty() && path != "/") {
    processors = std::min(processors, limit(mount / path.substr(1)));
    path.resize(path.rfind('/'));
  }
  return processors;
}

int num_bound_processors() {
  // More than the set holds are there: then it is not asked.
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return CPU_COUNT(&set);
  return static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace

double cgroup_processors(const fs::path& membership, const fs::path& mount) {
  double processors = kUnlimited;
  std::ifstream file(membership);
  // HIERARCHY:CONTROLLERS:/PATH; version 2 has hierarchy 0 and names no controller.
  for (std::string line; std::getline(file, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string path = line.substr(second + 1);
    if (!path.starts_with('/')) continue;
    if (controllers.empty()) {
      for (const fs::path& root : {mount, mount / "unified"}) {
        processors = std::min(processors, least(root, path, limit_v2));
      }
    } else if (("," + controllers + ",").find(",cpu,") != std::string::npos) {
      for (const fs::path& root : {mount / "cpu", mount / controllers}) {
        processors = std::min(processors, least(root, path, limit_v1));
      }
    }
  }
  return processors;
}

int num_usable_processors() {
  const double bound = std::max(1, num_bound_processors());
  const double limit = std::ceil(cgroup_processors("/proc/self/cgroup", "/sys/fs/cgroup"));
  return static_cast<int>(std::clamp(limit, 1., bound));
}

}  // namespace treeroll
