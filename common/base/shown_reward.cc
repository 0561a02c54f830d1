#include "common/base/shown_reward.h"

#include <fmt/format.h>

#include <cmath>

namespace treeroll {

std::string shown_reward(double reward) {
  constexpr double kSmall = .01;
  return std::fabs(reward) < kSmall ? fmt::format("{:.3g}", reward) : fmt::format("{:.3f}", reward);
}

}  // namespace treeroll
