#include "learner/fit/automatic_start.h"

#include "common/settings/settings_reader.h"
#include "learner/fit/demonstration_settings.h"
#include "learner/fit/missing_outputs.h"
#include "learner/fit/network_start.h"
#include "learner/fit/spline_start.h"

namespace treeroll {

StartPolicy read_automatic_start(SettingsReader& policy, const StartSources& sources) {
  if (policy.choice("start", {"fit", "constant"}, "fit",
                    {.meaning = "A fit to a demonstration, or one number for each output and no "
                                "demonstration"}) == "constant") {
    return policy.has("ranges") ? read_network_start(policy, sources)
                                : read_constant_spline(policy, {8});
  }
  const Demonstration demonstration = read_demonstration(policy.table("demonstration"), sources);
  if (demonstration.input_dim > 1 || !is_complete(demonstration.data)) {
    return read_network_start(policy, sources);
  }
  return can_be_corrected(demonstration) ? read_correction_start(policy, sources)
                                         : read_spline_start(policy, sources);
}

}  // namespace treeroll
