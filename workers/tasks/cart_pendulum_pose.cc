#include "workers/tasks/cart_pendulum_pose.h"

#include "common/numbers/elementary.h"

namespace treeroll {

Pose pose(const sim::DoublePendulum& links, const sim::CartPendulumState& s) {
  constexpr double kHalfWidthM = .1;
  constexpr double kHeightM = .06;
  const double joint_x_m = s.y - links.l1 * elementary::sin(s.phi1);
  const double joint_y_m = links.l1 * elementary::cos(s.phi1);
  const double left_m = s.y - kHalfWidthM;
  const double right_m = s.y + kHalfWidthM;
  return {{{left_m, 0}, {right_m, 0}, {right_m, -kHeightM}, {left_m, -kHeightM}, {left_m, 0}},
          {{s.y, 0},
           {joint_x_m, joint_y_m},
           {joint_x_m - links.l2 * elementary::sin(s.phi2),
            joint_y_m + links.l2 * elementary::cos(s.phi2)}}};
}

std::optional<sim::DoublePendulum> visible_links(const sim::PlantSettings& plant,
                                                 const PlantVariation& variation) {
  if (variation.parameter_fraction > 0) return std::nullopt;
  return plant.parameters;
}

}  // namespace treeroll
