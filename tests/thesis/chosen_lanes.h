#pragma once

#include <vector>

/// A program with chosen_lanes.cc computes with as many lanes as the test says: it takes the place
/// of common/numbers/processor.cc.
namespace treeroll::test {

/// Those that this processor has, 1 among them, ascending.
std::vector<int> lane_widths();

/// From here on. The widest until it is called.
void choose_lanes(int width);

}  // namespace treeroll::test
