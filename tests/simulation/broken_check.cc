#include "tests/simulation/broken_check.h"

#include <string>

#include "common/base/check.h"

namespace treeroll {

void check_failed(const char* file, int line, const char*, std::string_view message) {
  throw simulation::BrokenCheck(std::string(file) + ":" + std::to_string(line) +
                                ": CHECK: " + std::string(message));
}

}  // namespace treeroll
