#pragma once

#include <span>
#include <string_view>

namespace treeroll {
class SettingsReader;
}

namespace treeroll::explore {

struct ExplorationSettings;

/// A kind of update rule as a study names it.
struct UpdateRuleKind {
  std::string_view name;  ///< exploration.rule
  /// Reads the keys of [exploration] that are the rule's own into `settings.rule`. A rule may also
  /// give `settings.initial_step`. Throws ConfigError.
  void (*read)(SettingsReader& exploration, ExplorationSettings& settings);
};

/// The rules that there are. Which one a study has that names none: exploration_settings.h.
std::span<const UpdateRuleKind> standard_update_rules();

}  // namespace treeroll::explore
