#include "workers/tasks/goal_trajectory.h"

#include <array>
#include <numbers>

#include "common/base/elementary.h"
#include "common/base/settings_reader.h"
#include "common/mixture/gmr.h"
#include "common/mixture/mixture_settings.h"

namespace treeroll {
namespace {

/// Nothing is simulated, so the time may be in any unit.
constexpr NumberRule kDuration{.min = 0, .max = 1e6, .min_allowed = false};
constexpr std::int64_t kSamplesMax = 100'000;

std::vector<double> read_times(SettingsReader& settings, double duration_s) {
  return sample_times(duration_s,
                      static_cast<int>(settings.integer("samples", 1, kSamplesMax, 100)));
}

}  // namespace

std::vector<double> sample_times(double duration_s, int num_samples) {
  std::vector<double> times_s;
  for (int i = 0; i < num_samples; ++i) times_s.push_back(duration_s * (i + .5) / num_samples);
  return times_s;
}

GoalTrajectory read_mixture_goal(SettingsReader& settings) {
  const double duration_s = settings.number("duration_s", kDuration, 2);
  GoalTrajectory goal{
      .times_s = read_times(settings, duration_s), .outputs = {}, .time_name = "time_s"};
  SettingsReader table = settings.table("goal");
  const Gmm mixture = read_mixture(table, std::array{0., duration_s});
  if (mixture.input_dim() != 1) table.refuse("inputs", "must be 1: a trajectory is over time");
  table.finish();
  const Gmr gmr(mixture);
  goal.outputs.resize(mixture.output_dim(), static_cast<Eigen::Index>(goal.times_s.size()));
  for (std::size_t i = 0; i < goal.times_s.size(); ++i) {
    goal.outputs.col(static_cast<Eigen::Index>(i)) =
        gmr.regress(Eigen::VectorXd::Constant(1, goal.times_s[i]));
  }
  for (int o = 1; o <= mixture.output_dim(); ++o) {
    goal.names.push_back(mixture.output_dim() == 1 ? "x" : "x" + std::to_string(o));
  }
  return goal;
}

GoalTrajectory read_spiral_goal(SettingsReader& settings) {
  const double duration = settings.number("duration", kDuration, 5 * std::numbers::pi);
  GoalTrajectory goal{.times_s = read_times(settings, duration),
                      .outputs = {},
                      .time_name = "t",
                      .names = {"x", "y"}};
  goal.outputs.resize(2, static_cast<Eigen::Index>(goal.times_s.size()));
  for (std::size_t i = 0; i < goal.times_s.size(); ++i) {
    const double t = goal.times_s[i];
    goal.outputs.col(static_cast<Eigen::Index>(i)) << elementary::sin(t), elementary::cos(t);
  }
  return goal;
}

}  // namespace treeroll
