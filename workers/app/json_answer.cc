#include "workers/app/json_answer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/base/config_error.h"

namespace treeroll::worker {

using nlohmann::json;

JsonAnswer::JsonAnswer() : standard_output_(fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3)) {
  if (standard_output_ < 0 || dup2(STDERR_FILENO, STDOUT_FILENO) < 0) {
    throw std::runtime_error("standard output and standard error must be open");
  }
}

JsonAnswer::~JsonAnswer() {
  std::cout.flush();
  std::fflush(stdout);
  dup2(standard_output_, STDOUT_FILENO);
  close(standard_output_);
}

int JsonAnswer::give(const json& value) const {
  const std::string line = value.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t size = write(standard_output_, line.data() + written, line.size() - written);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return 1;
    written += static_cast<std::size_t>(size);
  }
  return 0;
}

int JsonAnswer::refuse(const ConfigError& error) const {
  const json details{{"key", error.key()}, {"value", error.value()}, {"rule", error.rule()}};
  static_cast<void>(give({{"error", details}}));
  return 2;
}

}  // namespace treeroll::worker
