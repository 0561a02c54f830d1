#include "workers/tasks/swing_up_task.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "common/settings/settings_reader.h"
#include "workers/tasks/setting_rules.h"

namespace treeroll {
double swing_up_cost(const sim::CartPendulumState& s) {
  constexpr double kPi = std::numbers::pi;
  const double y = 7 * s.y / 10;
  return 5 / (kPi * kPi) * (s.phi1 * s.phi1 + s.phi2 * s.phi2) + y * y * y * y +
         (s.phi1_rate * s.phi1_rate + s.phi2_rate * s.phi2_rate + s.y_rate * s.y_rate) / 50;
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
    void see(double, const sim::CartPendulumState& state) override {
      cost_ = swing_up_cost(state);
      lowest_ = std::min(lowest_, cost_);
    }
    void append_columns(std::vector<double>& row) const override { row.push_back(cost_); }
    double loss() const override { return lowest_; }

   private:
    double cost_ = 0;
    double lowest_ = std::numeric_limits<double>::infinity();
  };
  return std::make_unique<LowestCost>();
}

std::vector<std::string> SwingUpTask::judge_columns() const { return {"cost"}; }

}  // namespace treeroll
