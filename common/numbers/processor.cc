#include "common/numbers/processor.h"

namespace treeroll {

int widest_lanes() {
  static const int widest =
      __builtin_cpu_supports("avx512f") ? 8 : (__builtin_cpu_supports("avx2") ? 4 : 2);
  return widest;
}

}  // namespace treeroll
