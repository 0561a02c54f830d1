#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "learner/core/recheck_record.h"

namespace treeroll {

/// What has come of roll-outs that were run again on another worker, a sentence each: how many
/// differ, who was outvoted, which numeric classes differ. Empty if none was run again.
std::vector<std::string> remarks(const RecheckRecord& record);

/// {"rechecked", "disputed", "undecided", "workers": [...], "classes": [...]}.
nlohmann::json to_json_value(const RecheckRecord& record);

}  // namespace treeroll
