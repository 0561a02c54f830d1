#include "workers/app/process_limits.h"

#include <sys/resource.h>
#include <sys/time.h>

#include <cmath>

namespace treeroll::worker {

void turn_off_core_dumps() {
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
}

void limit_cpu_time(double limit_s) {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const double used_s = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1;
  const auto seconds = static_cast<rlim_t>(std::ceil(used_s + limit_s));
  const rlimit cpu{seconds, seconds + 1};
  setrlimit(RLIMIT_CPU, &cpu);
}

}  // namespace treeroll::worker
