#include "learner/explore/standard_update_rules.h"

#include "learner/explore/cem_rule.h"
#include "learner/explore/cma_es_rule.h"
#include "learner/explore/pi2_rule.h"
#include "learner/explore/power_rule.h"

namespace treeroll::explore {

std::span<const UpdateRuleKind> standard_update_rules() {
  static constexpr UpdateRuleKind kRules[] = {
      {"auto", read_automatic}, {"power", read_power},   {"pi2", read_pi2},
      {"cem", read_cem},        {"cma_es", read_cma_es},
  };
  return kRules;
}

}  // namespace treeroll::explore
