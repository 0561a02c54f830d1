#include "workers/tasks/swing_up_task.h"

#include <limits>
#include <numbers>

#include "common/settings/settings_reader.h"
#include "workers/tasks/setting_rules.h"
#include "workers/tasks/trace.h"

namespace treeroll {
SwingUpCost swing_up_terms(const sim::CartPendulumState& s) {
  constexpr double kPi = std::numbers::pi;
  const double y = 7 * s.y / 10;
  return {
      .angles = 5 / (kPi * kPi) * (s.phi1 * s.phi1 + s.phi2 * s.phi2),
      .cart = y * y * y * y,
      .rates = (s.phi1_rate * s.phi1_rate + s.phi2_rate * s.phi2_rate + s.y_rate * s.y_rate) / 50};
}

double swing_up_cost(const sim::CartPendulumState& state) {
  const SwingUpCost cost = swing_up_terms(state);
  return cost.angles + cost.cart + cost.rates;
}

TimeDrivenSettings read_swing_up_settings(SettingsReader& settings) {
  TimeDrivenSettings read;
  read.plant = sim::read_plant_settings(settings);
  read.variation = read_plant_variation(settings);
  read.duration_s = settings.number("duration_s", kSimulatedTime, read.duration_s,
                                    {.meaning = "Simulated time", .unit = "s"});
  read.alpha = settings.number("alpha", kPositive, read.alpha,
                               {.meaning = "Of the reward exp(-alpha min c), (4-7)"});
  read.time_limit_s = read_time_limit_s(settings);
  read.start.phi1 = settings.number(
      "start_phi1", kAngle, -std::numbers::pi,
      {.meaning = "First angle at the start, at rest; 0 is upright", .unit = "rad"});
  read.start.phi2 = settings.number("start_phi2", kAngle, -std::numbers::pi,
                                    {.meaning = "Second angle at the start", .unit = "rad"});
  return read;
}

SwingUpTask::SwingUpTask(SettingsReader& settings)
    : TimeDrivenTask(read_swing_up_settings(settings)) {}

std::unique_ptr<TimeDrivenTask::Judge> SwingUpTask::judge() const {
  class LowestCost : public Judge {
   public:
    void see(double time_s, const sim::CartPendulumState& state) override {
      cost_ = swing_up_cost(state);
      if (!(cost_ < lowest_)) return;
      lowest_ = cost_;
      at_lowest_ = state;
      lowest_s_ = time_s;
    }
    void append_columns(std::vector<double>& row) const override { row.push_back(cost_); }
    double loss() const override { return lowest_; }
    void tell_terms(Trace& trace) const override {
      const SwingUpCost cost = swing_up_terms(at_lowest_);
      trace.set_term("least_cost", lowest_);
      trace.set_term("least_cost_angles", cost.angles);
      trace.set_term("least_cost_cart", cost.cart);
      trace.set_term("least_cost_rates", cost.rates);
      trace.set_term("least_cost_time_s", lowest_s_);
    }

   private:
    double cost_ = 0;
    double lowest_ = std::numeric_limits<double>::infinity();
    sim::CartPendulumState at_lowest_;
    double lowest_s_ = 0;
  };
  return std::make_unique<LowestCost>();
}

std::vector<std::string> SwingUpTask::judge_columns() const { return {"cost"}; }

}  // namespace treeroll
