#pragma once

#include "common/policy/policy_registry.h"

namespace treeroll {

/// The kinds of policies that learner and workers know: the one table of them. How they
/// start stays open here; learner/fit/start_policy.h adds it, for only the learner fits policies.
PolicyRegistry standard_policies();

}  // namespace treeroll
