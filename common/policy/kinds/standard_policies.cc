#include "common/policy/kinds/standard_policies.h"

#include "common/policy/ds_gmr/ds_gmr_policy.h"
#include "common/policy/linear/linear_policy.h"
#include "common/policy/network/network_policy.h"
#include "common/policy/tree/tree_policy.h"

namespace treeroll {

PolicyRegistry standard_policies() {
  PolicyRegistry registry;
  registry.add("tree", tree_from_content, {});
  registry.add("spline", spline_from_content, {});
  registry.add("correction", correction_from_content, {});
  registry.add("rbf", rbf_from_content, {});
  registry.add("dmp", dmp_from_content, {});
  registry.add("ds_gmr", ds_gmr_from_content, {});
  registry.add("network", network_from_content, {});
  return registry;
}

}  // namespace treeroll
