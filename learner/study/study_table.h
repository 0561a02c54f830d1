#pragma once

#include <optional>
#include <string>

#include "learner/core/study.h"

namespace treeroll {

class SettingsReader;

/// What [study] says to a condition.
struct StudyBudget {
  int num_rollouts = 0;
  int in_flight = 1;
};

/// Reads [study]: what all conditions share into `study`, and what each has for itself. Throws
/// ConfigError. Does not call finish(): the caller does.
StudyBudget read_study_table(SettingsReader& reader, Study& study);

/// Of [policy], before all other keys: the policy that takes the place of what they describe, as a
/// file or as the text itself. Never both: throws ConfigError.
inline constexpr const char* kGivenPolicy = "given";
std::optional<std::string> read_start_file_name(SettingsReader& policy);
std::optional<std::string> read_given_policy(SettingsReader& policy);

}  // namespace treeroll
