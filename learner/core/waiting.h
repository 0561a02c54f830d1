#pragma once

#include <string>
#include <vector>

#include "learner/core/study.h"
#include "learner/core/workforce.h"

namespace treeroll::learner {

/// Why nothing moves, for a person; empty while something does.
/// @param task_ids       by condition
/// @param num_at_switch  runs whose next layer's start is to be computed
std::string why_waiting(const Study& study, const std::vector<ContentHash>& task_ids,
                        const Workforce& workforce, std::size_t num_at_switch, TimePoint now);

}  // namespace treeroll::learner
