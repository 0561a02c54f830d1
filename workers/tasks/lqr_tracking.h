#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "common/settings/settings_reader.h"
#include "sim/plant_settings.h"
#include "workers/tasks/riccati.h"

/// Feedback of a task of its own, beside what the policy gives: it keeps the plant near a motion or
/// a rest that is known.
namespace treeroll {

/// What the cart can do, in m/s^2.
inline constexpr NumberRule kAccelerationMax{.min = 0, .max = 1e6, .min_allowed = false};

/// The regulator about rest with both links at one angle, upright (0) or hanging (-pi).
class RestRegulator {
 public:
  /// Reads the table `lqr` of a task, with the weights of what is to be kept small:
  ///
  ///   lqr = {state_weights = [100, 100, 10, 1, 1, 1],   # of phi1, phi2, y and their rates
  ///          input_weight = .1}                         # of the acceleration: 1 m/s^2 costs as
  ///                                                     # much as .03 rad
  ///
  /// Throws ConfigError, also for weights of which no stable regulator comes, or one that is too
  /// fast for a simulation of the plant's step to follow.
  RestRegulator(SettingsReader& settings, const sim::PlantSettings& plant, double rest_rad);

  /// -K x, where x is the state less that of rest.
  double acceleration(const sim::CartPendulumState& state) const;
  const QuadraticCost& cost() const { return cost_; }
  const sim::StateMatrix& riccati() const { return riccati_; }
  const sim::StateVector& gains() const { return gains_; }

 private:
  sim::StateVector rest_;
  QuadraticCost cost_;
  sim::StateMatrix riccati_;
  sim::StateVector gains_;
};

/// A motion that a simulation has gone through, between its output steps too.
class NominalMotion {
 public:
  /// In the order of time.
  void add(double time_s, const sim::DoublePendulum& pendulum, const sim::CartPendulumState& state,
           double cart_acceleration);
  /// By cubic Hermite interpolation: states and their rates are those of the equations of motion at
  /// the output steps. Precondition: a time from the first step added to the last.
  sim::StateVector state(double time_s) const;

 private:
  struct Step {
    double time_s;
    sim::StateVector state;
    sim::StateVector rate;
  };
  std::vector<Step> steps_;
};

/// The time-varying regulator along a motion, from its start to an instant from which the regulator
/// of rest goes on.
class MotionRegulator {
 public:
  /// @param motion       up to end_s at least; must outlive this
  /// @param acceleration of the cart along it, at any time in [0, end_s]
  /// @param end_s        positive
  MotionRegulator(const sim::DoublePendulum& pendulum, const NominalMotion& motion,
                  const std::function<double(double time_s)>& acceleration, double end_s,
                  const RestRegulator& end);

  /// Not where the motion is so wild that the integration of its gains leaves the finite numbers.
  bool is_finite() const;
  /// -K(t) (x - x*(t)), what is to be added to the motion's own acceleration.
  double correction(double time_s, const sim::CartPendulumState& state) const;

 private:
  const NominalMotion& motion_;
  double end_s_;
  std::vector<sim::StateVector> gains_;
};

}  // namespace treeroll
