#include "workers/app/program_log.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

namespace treeroll::worker {

bool LineBudget::allows(TimePoint now) {
  if (now - since_ >= std::chrono::seconds(1)) {
    since_ = now;
    num_passed_ = 0;
  }
  const bool passes = num_passed_ < kLinesPerSecond;
  if (passes) {
    ++num_passed_;
  } else {
    ++num_left_out_;
  }
  return passes;
}

std::int64_t LineBudget::take_left_out() { return std::exchange(num_left_out_, 0); }

void ProgramLog::operator()(const std::string& where, const std::string& line) {
  if (!budget_.allows(TimePoint(std::chrono::steady_clock::now().time_since_epoch()))) return;
  if (const std::int64_t number = budget_.take_left_out(); number > 0) {
    spdlog::warn("{} lines of the program are left out", number);
  }
  spdlog::info("{}: {}", where, line);
}

}  // namespace treeroll::worker
