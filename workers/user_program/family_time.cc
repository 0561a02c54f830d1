#include "workers/user_program/family_time.h"

#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

namespace treeroll::worker {
namespace {

/// A program that starts processes faster than they can be counted.
constexpr std::size_t kProcessesMax = 1000;

/// Of the children that a process has waited for: fields 16 and 17 of its stat.
Duration waited_for(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/stat", pid));
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(')');  // the name may hold anything
  if (name_end == std::string::npos) return {};
  std::istringstream fields(line.substr(name_end + 1));
  constexpr int kFieldsBefore = 13;  // from the state, field 3, to stime, field 15
  std::string skipped;
  for (int i = 0; i < kFieldsBefore; ++i) fields >> skipped;
  std::int64_t user = 0;
  std::int64_t system = 0;
  if (!(fields >> user >> system)) return {};
  return std::chrono::nanoseconds((user + system) * (1'000'000'000 / sysconf(_SC_CLK_TCK)));
}

/// Each thread has children of its own. A process that ends meanwhile has none.
void add_children(pid_t pid, std::vector<pid_t>& family) {
  std::error_code gone;
  const std::filesystem::directory_iterator threads(fmt::format("/proc/{}/task", pid), gone);
  for (auto thread = begin(threads); !gone && thread != end(threads); thread.increment(gone)) {
    std::ifstream file(thread->path() / "children");
    for (pid_t child = 0; file >> child;) family.push_back(child);
  }
}

}  // namespace

std::optional<Duration> cpu_time_of(pid_t pid) {
  clockid_t clock = 0;
  timespec time{};
  if (clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &time) != 0) {
    return std::nullopt;
  }
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

Duration cpu_time_of_family(pid_t pid) {
  std::vector<pid_t> family{pid};
  Duration total{};
  for (std::size_t i = 0; i < std::min(family.size(), kProcessesMax); ++i) {
    total += cpu_time_of(family[i]).value_or(Duration{}) + waited_for(family[i]);
    add_children(family[i], family);
  }
  return total;
}

}  // namespace treeroll::worker
