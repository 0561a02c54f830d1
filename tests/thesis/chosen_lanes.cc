#include "tests/thesis/chosen_lanes.h"

#include "common/numbers/processor.h"

namespace treeroll {
namespace {

int& chosen() {
  static int width = test::lane_widths().back();
  return width;
}

}  // namespace

int widest_lanes() { return chosen(); }

namespace test {

std::vector<int> lane_widths() {
  std::vector<int> widths = {1, 2};
  if (__builtin_cpu_supports("avx2")) widths.push_back(4);
  if (__builtin_cpu_supports("avx512f")) widths.push_back(8);
  return widths;
}

void choose_lanes(int width) { chosen() = width; }

}  // namespace test
}  // namespace treeroll
