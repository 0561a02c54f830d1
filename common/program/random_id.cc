#include "common/program/random_id.h"

#include <sys/random.h>

#include "common/base/check.h"

namespace treeroll {

std::int64_t random_id() {
  std::uint64_t bits = 0;
  while (bits >> 1U == 0) {
    CHECK(getrandom(&bits, sizeof bits, 0) == sizeof bits, "no random numbers");
  }
  return static_cast<std::int64_t>(bits >> 1U);
}

}  // namespace treeroll
