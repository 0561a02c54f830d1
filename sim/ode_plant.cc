#include "sim/ode_plant.h"

#include <ode/ode.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "common/numbers/elementary.h"
#include "sim/ode_guard.h"
#include "sim/output_steps.h"

static_assert(sizeof(dReal) == sizeof(double), "ODE must be built with double precision");

namespace treeroll::sim {
namespace {

/// The pendulum moves in ODE's x-y plane: x along the cart's track, y up, angles about z.
class World {
 public:
  World(const DoublePendulum& pendulum, const CartPendulumState& start)
      : pendulum_(pendulum), state_(start) {
    error_ = run_ode_guarded([this] { build(); });
    usable_ = !error_;
  }
  ~World() {
    // A world that an error left in the middle of a call cannot be destroyed safely: it leaks.
    if (usable_) run_ode_guarded([this] { dWorldDestroy(world_); });
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  Result<CartPendulumState> step(double step_s, double cart_acceleration) {
    if (!error_) error_ = run_ode_guarded([&] { step_unguarded(step_s, cart_acceleration); });
    if (error_) {
      usable_ = false;
      return *error_;
    }
    if (!stepped_) return Error{"ODE ran out of memory"};
    if (!can_unwrap(step_s)) return Error{"a link turns more than half a turn a step"};
    if (!in_plane_) return Error{"a link left the plane of motion"};
    return state_;
  }

 private:
  /// Whether the angles, of which ODE knows only the place within a turn, can be followed.
  bool can_unwrap(double step_s) const {
    return std::fabs(state_.phi1_rate) * step_s < std::numbers::pi &&
           std::fabs(state_.phi2_rate) * step_s < std::numbers::pi;
  }
  void build();
  dBodyID add_link(double x, double y, double angle, double x_rate, double y_rate,
                   double angle_rate, double mass, double inertia);
  dJointID add_hinge(dBodyID first, dBodyID second, double x, double y);
  void step_unguarded(double step_s, double cart_acceleration);

  const DoublePendulum& pendulum_;
  CartPendulumState state_;
  dWorldID world_ = nullptr;
  dBodyID cart_ = nullptr, link1_ = nullptr, link2_ = nullptr;
  dJointID hinge1_ = nullptr, hinge2_ = nullptr;
  bool stepped_ = true;
  bool in_plane_ = true;
  bool usable_ = false;
  std::optional<Error> error_;
};

dBodyID World::add_link(double x, double y, double angle, double x_rate, double y_rate,
                        double angle_rate, double mass, double inertia) {
  const dBodyID link = dBodyCreate(world_);
  // The same inertia about all axes: only the one about z matters in the plane, and a multiple of
  // the identity does not change as the link turns.
  dMass link_mass;
  dMassSetParameters(&link_mass, mass, 0, 0, 0, inertia, inertia, inertia, 0, 0, 0);
  dBodySetMass(link, &link_mass);
  dBodySetPosition(link, x, y, 0);
  const dQuaternion turn = {elementary::cos(angle / 2), 0, 0, elementary::sin(angle / 2)};
  dBodySetQuaternion(link, turn);
  dBodySetLinearVel(link, x_rate, y_rate, 0);
  dBodySetAngularVel(link, 0, 0, angle_rate);
  return link;
}

dJointID World::add_hinge(dBodyID first, dBodyID second, double x, double y) {
  const dJointID hinge = dJointCreateHinge(world_, nullptr);
  dJointAttach(hinge, first, second);
  dJointSetHingeAnchor(hinge, x, y, 0);
  dJointSetHingeAxis(hinge, 0, 0, 1);
  return hinge;
}

void World::build() {
  const DoublePendulum& p = pendulum_;
  const double s1 = elementary::sin(state_.phi1), c1 = elementary::cos(state_.phi1);
  const double s2 = elementary::sin(state_.phi2), c2 = elementary::cos(state_.phi2);
  const double w1 = state_.phi1_rate, w2 = state_.phi2_rate;
  world_ = dWorldCreate();
  dWorldSetGravity(world_, 0, -p.gravity, 0);

  cart_ = dBodyCreate(world_);
  dBodySetPosition(cart_, state_.y, 0, 0);
  dBodySetKinematic(cart_);

  // (B-2), where the print lacks signs and sums: positions of the centres of gravity.
  const double elbow_x = state_.y - p.l1 * s1, elbow_y = p.l1 * c1;
  link1_ = add_link(state_.y - p.a1 * s1, p.a1 * c1, state_.phi1, state_.y_rate - p.a1 * c1 * w1,
                    -p.a1 * s1 * w1, w1, p.m1, p.j1);
  link2_ = add_link(elbow_x - p.a2 * s2, elbow_y + p.a2 * c2, state_.phi2,
                    state_.y_rate - p.l1 * c1 * w1 - p.a2 * c2 * w2,
                    -p.l1 * s1 * w1 - p.a2 * s2 * w2, w2, p.m2, p.j2);
  hinge1_ = add_hinge(link1_, cart_, state_.y, 0);
  hinge2_ = add_hinge(link2_, link1_, elbow_x, elbow_y);
}

/// Angle of a body about z, in the turn nearest to the angle before.
double unwrapped_angle(dBodyID body, double before) {
  const dReal* q = dBodyGetQuaternion(body);
  const double wrapped = 2 * elementary::atan2(q[3], q[0]);
  return before + std::remainder(wrapped - before, 2 * std::numbers::pi);
}

/// Nothing acts across the plane, so that these are exact zeros in practice; NaN is for the caller.
bool is_in_plane(dBodyID body) {
  constexpr double kTolerance = 1e-9;
  const dReal* q = dBodyGetQuaternion(body);
  return !(std::fabs(dBodyGetPosition(body)[2]) > kTolerance || std::fabs(q[1]) > kTolerance ||
           std::fabs(q[2]) > kTolerance);
}

void World::step_unguarded(double step_s, double cart_acceleration) {
  // A kinematic body pushes the links with the velocity it has: giving it the one of the step's end
  // makes ODE's implicit velocity step consistent with the command.
  dBodySetLinearVel(cart_, state_.y_rate + step_s * cart_acceleration, 0, 0);
  // (B-4) with the coupling the print lacks: friction acts on the relative rates.
  const double w1 = state_.phi1_rate, w2 = state_.phi2_rate;
  dJointAddHingeTorque(hinge1_, -pendulum_.d1 * w1);
  dJointAddHingeTorque(hinge2_, -pendulum_.d2 * (w2 - w1));
  stepped_ = dWorldStep(world_, step_s) != 0;
  in_plane_ = is_in_plane(link1_) && is_in_plane(link2_);

  state_.phi1 = unwrapped_angle(link1_, state_.phi1);
  state_.phi2 = unwrapped_angle(link2_, state_.phi2);
  state_.y = dBodyGetPosition(cart_)[0];
  state_.phi1_rate = dBodyGetAngularVel(link1_)[2];
  state_.phi2_rate = dBodyGetAngularVel(link2_)[2];
  state_.y_rate = dBodyGetLinearVel(cart_)[0];
}

}  // namespace

OdePlant::OdePlant(const DoublePendulum& pendulum, double step_s)
    : pendulum_(pendulum), step_s_(step_s) {
  initialise_ode();
}

Result<CartPendulumState> OdePlant::simulate(const CartPendulumState& start, double duration_s,
                                             const CartAcceleration& input,
                                             const StateVisitor& visit) {
  // ODE would refuse it by an assertion, and such a world cannot be destroyed.
  if (!is_finite(start)) return not_finite(start, 0);
  World world(pendulum_, start);
  return run_output_steps(
      start, duration_s, step_s_, input, visit,
      [&](double t, double h, const CartPendulumState& state, double) -> Result<CartPendulumState> {
        // The input at the middle of the step integrates the commanded velocity to second order;
        // the one at its start would make the state's error at 1 ms fourteen times larger.
        const double cart_acceleration = input(t + h / 2, state);
        if (!std::isfinite(cart_acceleration)) return not_finite("cart's acceleration", t + h / 2);
        return world.step(h, cart_acceleration);
      });
}

std::vector<double> OdePlant::input_times(double duration_s) const {
  return OutputSteps(duration_s, step_s_).starts_and_middles_s();
}

}  // namespace treeroll::sim
