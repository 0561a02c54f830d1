#pragma once

#include <cstdint>

#include "common/settings/settings_reader.h"

namespace treeroll::explore {

// Wide enough for any unit, narrow enough that their products stay finite and above 0.
inline constexpr NumberRule kVariance{.min = 1e-30, .max = 1e30};
inline constexpr NumberRule kFactor{.min = 1e-12, .max = 1e12};
/// Of a run's budget: counts of its results need not go further.
inline constexpr std::int64_t kMaxRollouts = 1'000'000'000;

}  // namespace treeroll::explore
