#pragma once

#include "common/base/settings_reader.h"

namespace treeroll {

/// Rules of settings that several tasks have.
inline constexpr NumberRule kTimeLimit{.min = .001, .max = 86400};
inline constexpr NumberRule kAngle{.min = -1000, .max = 1000};
/// Of a simulation, in s, and of a path to follow, in the path's unit of time.
inline constexpr NumberRule kDuration{.min = 0, .max = 1000, .min_allowed = false};
inline constexpr NumberRule kPathDuration{.min = 0, .max = 1e6, .min_allowed = false};

}  // namespace treeroll
