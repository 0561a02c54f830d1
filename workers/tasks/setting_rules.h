#pragma once

#include "common/base/settings_reader.h"

namespace treeroll {

/// Of an angle of the pendulum, in rad, that a study gives.
inline constexpr NumberRule kAngle{.min = -1000, .max = 1000};

}  // namespace treeroll
