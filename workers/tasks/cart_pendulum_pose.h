#pragma once

#include <optional>

#include "workers/tasks/plant_variation.h"
#include "workers/tasks/trace.h"

namespace treeroll {

/// Cart, joint and tip, (B-2). The cart is as large as the eye likes it: the plant's has no size.
Pose pose(const sim::DoublePendulum& links, const sim::CartPendulumState& state);

/// What is seen of a plant; nothing if its links are not known here.
std::optional<sim::DoublePendulum> visible_links(const sim::PlantSettings& plant,
                                                 const PlantVariation& variation);

}  // namespace treeroll
