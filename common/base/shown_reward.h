#pragma once

#include <string>

namespace treeroll {

/// A reward, or a difference of two, for people: three decimals, or as many as show three
/// significant digits of a small one. "0.978", "0.00123", "1.23e-07", "0".
std::string shown_reward(double reward);

}  // namespace treeroll
