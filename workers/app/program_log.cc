#include "workers/app/program_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace treeroll::worker {

bool LineBudget::allows(TimePoint now) {
  const std::int64_t num_gained = (now - since_) / pause_;
  since_ += num_gained * pause_;
  num_left_ = std::min<std::int64_t>(num_left_ + num_gained, kLinesAtOnce);
  if (num_left_ == 0) {
    ++num_left_out_;
    return false;
  }
  --num_left_;
  return true;
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
