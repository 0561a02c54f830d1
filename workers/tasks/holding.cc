#include "workers/tasks/holding.h"

#include <fmt/format.h>

#include <cmath>

#include "workers/tasks/setting_rules.h"

namespace treeroll {

HoldingRule read_holding_rule(SettingsReader& table, double until_s) {
  HoldingRule rule;
  rule.until_s = until_s;
  rule.after_s = table.number(
      "after_s", {.min = 0, .max = kSimulatedTime.max}, rule.after_s,
      {.meaning = "From when on the plant must stay, below the end of holding", .unit = "s"});
  rule.angle_max_rad = table.number(
      "angle_max_rad", {.min = 0, .max = kAngle.max, .min_allowed = false}, rule.angle_max_rad,
      {.meaning = "How far both angles may go from the target while it holds", .unit = "rad"});
  if (rule.after_s >= until_s) {
    table.refuse("after_s", fmt::format("{:g} s must be below the {:g} s at which holding ends",
                                        rule.after_s, until_s));
  }
  return rule;
}

void Holding::see(double time_s, const sim::CartPendulumState& state) {
  // Times are sums of the instant and the rule's, which round.
  constexpr double kRoundingS = 1e-9;
  if (time_s < rule_.after_s - kRoundingS || time_s > rule_.until_s + kRoundingS) return;
  is_seen_ = true;
  if (std::fabs(state.phi1) > rule_.angle_max_rad || std::fabs(state.phi2) > rule_.angle_max_rad) {
    has_fallen_ = true;
  }
}

}  // namespace treeroll
