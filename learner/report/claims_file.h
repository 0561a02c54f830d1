#pragma once

#include <filesystem>
#include <vector>

#include "learner/report/statistics/claim.h"

namespace treeroll::report {

/// Reads the claims of a TOML file, [[claims]] one by one, as strictly as a study: every key is
/// known, typed and within its rule, and no key is there that the kind of claim has no use for. A
/// claim with `each = ["multi", "single"]` is one claim for each word, put for {} in its text and
/// its conditions.
/// Throws StudyError "FILE:LINE: KEY = VALUE: RULE".
std::vector<Claim> read_claims(const std::filesystem::path& path);

}  // namespace treeroll::report
