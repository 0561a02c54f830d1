#include "common/policy/kinds/standard_policies.h"

#include "common/policy/linear/spline_policy.h"
#include "common/policy/tree/tree_policy.h"

namespace treeroll {

PolicyRegistry standard_policies() {
  PolicyRegistry registry;
  registry.add("tree", tree_from_content, {});
  registry.add("spline", spline_from_content, {});
  registry.add("correction", correction_from_content, {});
  return registry;
}

}  // namespace treeroll
