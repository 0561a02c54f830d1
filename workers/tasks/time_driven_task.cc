#include "workers/tasks/time_driven_task.h"

#include <utility>

#include "common/base/check.h"
#include "common/numbers/elementary.h"
#include "workers/tasks/cart_pendulum_pose.h"
#include "workers/tasks/trace.h"

namespace treeroll {

TimeDrivenTask::TimeDrivenTask(const TimeDrivenSettings& settings)
    : duration_s_(settings.duration_s),
      alpha_(settings.alpha),
      time_limit_s_(settings.time_limit_s),
      start_(settings.start),
      links_(visible_links(settings.plant, settings.variation)),
      plant_(settings.plant, settings.variation),
      input_times_s_(plant_.plant().input_times(duration_s_)) {}

TaskDescription TimeDrivenTask::description() const {
  return {.input_dim = 1,
          .output_dim = 1,
          .reward_min = 0,
          .reward_max = 1,
          .time_limit_s = time_limit_s_,
          .deterministic = plant_.deterministic(),
          .signals = {{"time_s"}, {"cart_acceleration_mps2"}}};
}

Outcome TimeDrivenTask::evaluate(Controller& controller, std::uint64_t seed) {
  return roll_out(controller, seed, nullptr);
}

Outcome TimeDrivenTask::evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) {
  std::vector<std::string> columns = {
      "time_s",          "phi1_rad",        "phi2_rad",   "y_m",
      "phi1_rate_radps", "phi2_rate_radps", "y_rate_mps", "cart_acceleration_mps2"};
  for (std::string& column : judge_columns()) columns.push_back(std::move(column));
  trace.set_columns(std::move(columns));
  const auto [inputs, outputs] = description().signals;
  trace.set_policy_columns(inputs, outputs);
  return roll_out(controller, seed, &trace);
}

Outcome TimeDrivenTask::roll_out(Controller& controller, std::uint64_t seed, Trace* trace) {
  CHECK(controller.input_dim() == 1 && controller.output_dim() == 1,
        "a controller from time to acceleration");
  return plant_.evaluate(
      seed, start_, [&](sim::CartPendulumPlant& plant, const sim::CartPendulumState& start) {
        const std::unique_ptr<Judge> so_far = judge();
        const auto see = [&](double time_s, const sim::CartPendulumState& s,
                             double cart_acceleration_mps2) {
          so_far->see(time_s, s);
          if (trace != nullptr) {
            std::vector<double> row = {time_s,      s.phi1,      s.phi2,   s.y,
                                       s.phi1_rate, s.phi2_rate, s.y_rate, cart_acceleration_mps2};
            so_far->append_columns(row);
            trace->add_row(row);
            if (links_) trace->add_pose(pose(*links_, s));
          }
          return true;
        };
        if (!input_times_s_.empty()) {
          const std::vector<double> inputs = accelerations(controller);
          const sim::OpenLoop rollout = {.start = start, .accelerations = inputs};
          const auto ends = plant.simulate_open_loop(
              {&rollout, 1}, duration_s_,
              [&](std::size_t, double time_s, const sim::CartPendulumState& s, double input) {
                see(time_s, s, input);
              });
          if (trace != nullptr) so_far->tell_terms(*trace);
          return outcome(ends[0], so_far->loss());
        }
        controller.start();
        const auto end = plant.simulate(
            start, duration_s_,
            [&](double time_s, const sim::CartPendulumState&) { return controller.act(time_s); },
            see);
        if (trace != nullptr) so_far->tell_terms(*trace);
        return outcome(end, so_far->loss());
      });
}

bool TimeDrivenTask::side_by_side() const {
  return plant_.deterministic() && plant_.plant().side_by_side();
}

std::vector<Outcome> TimeDrivenTask::evaluate_all(std::span<const Evaluation> evaluations) {
  if (!side_by_side()) return Task::evaluate_all(evaluations);
  std::vector<std::vector<double>> inputs;
  std::vector<sim::OpenLoop> rollouts;
  std::vector<std::unique_ptr<Judge>> judges;
  for (const Evaluation& one : evaluations) inputs.push_back(accelerations(one.controller));
  for (const auto& of_one : inputs) {
    rollouts.push_back({.start = start_, .accelerations = of_one});
    judges.push_back(judge());
  }
  const auto ends = plant_.plant().simulate_open_loop(
      rollouts, duration_s_,
      [&](std::size_t rollout, double time_s, const sim::CartPendulumState& s, double) {
        judges[rollout]->see(time_s, s);
      });
  std::vector<Outcome> outcomes;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    outcomes.push_back(outcome(ends[i], judges[i]->loss()));
  }
  return outcomes;
}

std::vector<double> TimeDrivenTask::accelerations(Controller& controller) const {
  std::vector<double> outputs(input_times_s_.size());
  controller.start();
  controller.act_all(input_times_s_, outputs);
  return outputs;
}

Outcome TimeDrivenTask::outcome(const Result<sim::CartPendulumState>& end, double loss) const {
  if (!end) return Outcome::failed(RolloutStatus::kDiverged, end.error().message);
  return Outcome::ok(elementary::exp(-alpha_ * loss));
}

}  // namespace treeroll
