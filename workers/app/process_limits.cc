#include "workers/app/process_limits.h"

#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <cmath>
#include <csignal>

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

void limit_memory(std::uint64_t bytes_max) {
  const rlimit data{bytes_max, bytes_max};
  setrlimit(RLIMIT_DATA, &data);
}

void end_likewise(bool exited, int code) {
  if (exited) _exit(code == 0 ? 1 : code);
  turn_off_core_dumps();
  std::signal(code, SIG_DFL);
  sigset_t only;
  sigemptyset(&only);
  sigaddset(&only, code);
  sigprocmask(SIG_UNBLOCK, &only, nullptr);
  raise(code);
  _exit(1);  // a signal that ends nobody
}

}  // namespace treeroll::worker
