// A worker that knows one more task: swing up a pendulum that hangs on a cart. All there is to a
// task of one's own is in this file: a class, and its registration in main().
#include <algorithm>
#include <limits>
#include <numbers>

#include "common/numbers/elementary.h"
#include "common/settings/settings_reader.h"
#include "workers/app/worker_main.h"
#include "workers/tasks/task.h"
#include "workers/tasks/trace.h"

namespace {

/// The policy gives the acceleration of the cart, in m/s^2, for the time in s. The reward is
/// exp(-least cost): 1 for a pendulum that at some instant stands upright, at rest, above the
/// middle of the track.
class PendulumTask : public treeroll::Task {
 public:
  /// Reads the keys of [task], each with its rule and its default. The learner refuses a study with
  /// a value against the rule, or with any other key, before it starts.
  explicit PendulumTask(treeroll::SettingsReader& settings)
      : length_m_(settings.number("length_m", {.min = .01, .max = 100}, .3,
                                  {.meaning = "Of the pendulum", .unit = "m"})),
        damping_per_s_(settings.number("damping_per_s", treeroll::kNotNegative, .1,
                                       {.meaning = "Of its joint", .unit = "1/s"})),
        duration_s_(settings.number("duration_s", {.min = .1, .max = 100}, 2.5,
                                    {.meaning = "Simulated time", .unit = "s"})) {}

  treeroll::TaskDescription description() const override {
    return {.input_dim = 1,
            .output_dim = 1,
            .reward_min = 0,
            .reward_max = 1,
            .time_limit_s = 5,
            .signals = {{"time_s"}, {"cart_acceleration_mps2"}}};
  }

  treeroll::Outcome evaluate(treeroll::Controller& controller, std::uint64_t /*seed*/) override {
    return roll_out(controller, nullptr);
  }

  /// For treeroll-evaluate, and for the report's pictures; a task may do without.
  treeroll::Outcome evaluate_traced(treeroll::Controller& controller, std::uint64_t /*seed*/,
                                    treeroll::Trace& trace) override {
    trace.set_columns({"time_s", "angle_rad", "cart_m", "cart_acceleration_mps2", "cost"});
    trace.set_policy_columns({"time_s"}, {"cart_acceleration_mps2"});
    return roll_out(controller, &trace);
  }

 private:
  static constexpr double kStepS = 1e-3;
  static constexpr double kCostMax = 1e9;

  struct State {
    double angle = -std::numbers::pi;  ///< from upright, in rad: it hangs
    double angle_rate = 0;
    double cart = 0;  ///< from the middle of the track, in m
    double cart_rate = 0;
  };

  treeroll::Outcome roll_out(treeroll::Controller& controller, treeroll::Trace* trace) {
    controller.start();
    State state;
    double cost_min = std::numeric_limits<double>::infinity();
    for (int n = 0; n < duration_s_ / kStepS; ++n) {
      // Tells the learner that this was no pendulum any more, however well it had begun.
      if (!(cost(state) < kCostMax))
        return treeroll::Outcome::failed(treeroll::RolloutStatus::kDiverged,
                                         "the cost is too high");
      cost_min = std::min(cost_min, cost(state));
      const double time_s = n * kStepS;
      const double cart_acceleration_mps2 = controller.act(time_s);
      if (trace != nullptr) {
        trace->add_row({time_s, state.angle, state.cart, cart_acceleration_mps2, cost(state)});
        trace->add_pose({{{state.cart, 0},
                          {state.cart - length_m_ * treeroll::elementary::sin(state.angle),
                           length_m_ * treeroll::elementary::cos(state.angle)}}});
      }
      advance(state, cart_acceleration_mps2);
    }
    // Of how good a policy is, what a person asks first: treeroll-evaluate, page and report show
    // it.
    if (trace != nullptr) trace->set_term("least_cost", cost_min);
    return treeroll::Outcome::ok(treeroll::elementary::exp(-cost_min));
  }

  static double cost(const State& s) {
    return .25 * s.angle * s.angle + .02 * s.angle_rate * s.angle_rate + .5 * s.cart * s.cart +
           .02 * s.cart_rate * s.cart_rate;
  }

  /// One step of semi-implicit Euler. The sine and cosine of treeroll, not those of the C library:
  /// then a policy has the same reward, to the bit, on every machine.
  void advance(State& s, double cart_acceleration_mps2) const {
    constexpr double kGravity = 9.81;
    const double angle_acceleration =
        (kGravity * treeroll::elementary::sin(s.angle) +
         cart_acceleration_mps2 * treeroll::elementary::cos(s.angle)) /
            length_m_ -
        damping_per_s_ * s.angle_rate;
    s.angle_rate += kStepS * angle_acceleration;
    s.angle += kStepS * s.angle_rate;
    s.cart_rate += kStepS * cart_acceleration_mps2;
    s.cart += kStepS * s.cart_rate;
  }

  double length_m_;
  double damping_per_s_;
  double duration_s_;
};

}  // namespace

int main(int argc, char** argv) {
  treeroll::TaskRegistry registry;
  treeroll::add_task<PendulumTask>(registry, "pendulum");
  treeroll::add_standard_tasks(registry);  // swing_up and synthetic; leave it out and they are gone
  return treeroll::worker_main(argc, argv, registry);
}
