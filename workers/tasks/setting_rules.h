#pragma once

#include "common/settings/settings_reader.h"

namespace treeroll {

/// Simulated time of a roll-out, in s.
inline constexpr NumberRule kSimulatedTime{.min = 0, .max = 1000, .min_allowed = false};

/// Of an angle of the pendulum, in rad.
inline constexpr NumberRule kAngle{.min = -1000, .max = 1000};

/// TaskDescription::time_limit_s, as every task here reads it: `time_limit_s`, 10 by default.
double read_time_limit_s(SettingsReader& settings);

}  // namespace treeroll
