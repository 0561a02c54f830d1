#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "workers/tasks/plant_variation.h"
#include "workers/tasks/task.h"

namespace treeroll {

/// What a time-driven roll-out is simulated on, and how its loss becomes a reward.
struct TimeDrivenSettings {
  sim::PlantSettings plant;
  PlantVariation variation;
  double duration_s = 2.5;
  double alpha = .25;  ///< the reward is exp(-alpha loss)
  double time_limit_s = 10;
  sim::CartPendulumState start;
};

/// A task whose policy gives the acceleration of the cart in m/s^2 for the time in s alone. So the
/// policy is asked for all its inputs at once where the plant has its times beforehand, and several
/// roll-outs are simulated side by side. A derived task says how far a motion is from the wanted
/// one.
class TimeDrivenTask : public Task {
 public:
  TaskDescription description() const override;
  Outcome evaluate(Controller& controller, std::uint64_t seed) override;
  std::vector<Outcome> evaluate_all(std::span<const Evaluation> evaluations) override;
  /// Variations make a plant an evaluation, and step control a time grid an evaluation.
  bool side_by_side() const override;
  /// Columns: time, state, input and those of its judge, at each output step of the plant; poses:
  /// the cart and the links, unless their lengths vary.
  Outcome evaluate_traced(Controller& controller, std::uint64_t seed, Trace& trace) override;

 protected:
  /// Sees a roll-out, output step by output step, its start included.
  class Judge {
   public:
    virtual ~Judge() = default;
    virtual void see(double time_s, const sim::CartPendulumState& state) = 0;
    /// Of the step that was seen last: a number for each of judge_columns().
    virtual void append_columns(std::vector<double>& row) const = 0;
    /// Of the whole roll-out, >= 0.
    virtual double loss() const = 0;
    /// What the loss is made of.
    virtual void tell_terms(Trace& /*trace*/) const {}
  };

  explicit TimeDrivenTask(const TimeDrivenSettings& settings);
  virtual std::unique_ptr<Judge> judge() const = 0;
  virtual std::vector<std::string> judge_columns() const = 0;

  double duration_s() const { return duration_s_; }
  const sim::CartPendulumState& start() const { return start_; }
  VariedPlant& plant() { return plant_; }

 private:
  /// @param trace  may be null
  Outcome roll_out(Controller& controller, std::uint64_t seed, Trace* trace);
  /// What the controller gives at input_times_s_, from its start.
  std::vector<double> accelerations(Controller& controller) const;
  /// A simulation that diverged has no reward, however good it was before.
  Outcome outcome(const Result<sim::CartPendulumState>& end, double loss) const;

  double duration_s_;
  double alpha_;
  double time_limit_s_;
  sim::CartPendulumState start_;
  std::optional<sim::DoublePendulum> links_;  ///< nothing if they vary
  VariedPlant plant_;
  std::vector<double> input_times_s_;  ///< of the plant; empty with step control
};

}  // namespace treeroll
