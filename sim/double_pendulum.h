#pragma once

namespace treeroll::sim {

/// Double pendulum on a cart, thesis appendix B and table of [7]. Lengths in m, masses in kg,
/// inertias about the centres of gravity in kg m^2, friction in N m s, gravity in m/s^2.
struct DoublePendulum {
  double l1 = .323, l2 = .480;   ///< link lengths
  double a1 = .2145, a2 = .223;  ///< joint to centre of gravity
  double m1 = .853, m2 = .510;
  double j1 = .0126, j2 = .0185;
  double d1 = .005, d2 = .005;  ///< viscous friction of the joints
  double gravity = 9.81;
  bool operator==(const DoublePendulum&) const = default;
};

}  // namespace treeroll::sim
