#include "workers/tasks/setting_rules.h"

namespace treeroll {

double read_time_limit_s(SettingsReader& settings) {
  return settings.number(
      "time_limit_s", {.min = .001, .max = 86400}, 10,
      {.meaning =
           "Processor time that a roll-out may take; one that takes more is ended and has failed",
       .unit = "s"});
}

}  // namespace treeroll
