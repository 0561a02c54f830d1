// What the loss of messages costs in time: roll-outs per second of virtual time, free of the noise
// of a machine. Here nothing takes processor time, so every wait counts in full.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;

struct Cost {
  double rollouts_per_s = 0;
  double simulations = 0;  ///< a roll-out
  double reissues = 0;     ///< a roll-out
};

/// Thirty runs, one roll-out of each in flight, on a worker of two evaluators across a network of
/// small frames.
Cost learn(std::uint64_t seed, Duration rollout_time, int num_rollouts_each, double loss) {
  Scenario scenario = calm_scenario(seed);
  Study& study = scenario.studies[0];
  study.repetitions = 30 / static_cast<int>(study.conditions.size());
  study.in_sequence = true;
  for (Condition& condition : study.conditions) {
    condition.exploration.num_rollouts = num_rollouts_each;
    condition.exploration.in_flight = 1;
  }
  scenario.knows_task = true;
  scenario.batch_bytes_max = 1400;
  scenario.task = {.duration_min = rollout_time, .duration_max = rollout_time};
  scenario.network = {.loss = loss, .delay_min = microseconds(50), .delay_max = microseconds(150)};
  scenario.workers.assign(1, {TimePoint{}, 2});
  scenario.reading_delay = microseconds(50);
  scenario.sync_delay = milliseconds(10);
  scenario.load_time = microseconds(200);
  scenario.faults_end = TimePoint(hours(1));
  Simulation simulation(scenario);
  simulation.run();
  const Observer& seen = simulation.observer();
  EXPECT_FALSE(seen.broken()) << seen.violation() << ", seed " << seed;
  const double num_wanted = num_rollouts(scenario) + 2 * num_runs(scenario);
  return {num_wanted / to_seconds(simulation.end() - TimePoint{}),
          static_cast<double>(seen.num_simulations) / num_wanted,
          static_cast<double>(seen.num_reissued) / num_wanted};
}

Cost mean_cost(Duration rollout_time, int num_rollouts_each, double loss) {
  // Which message is lost is chance, and one more message draws it anew: the mean over a few
  // seeds moves by some hundredths then.
  constexpr int kNumSeeds = 5;
  Cost mean;
  for (std::uint64_t seed = 1; seed <= kNumSeeds; ++seed) {
    const Cost cost = learn(seed, rollout_time, num_rollouts_each, loss);
    mean.rollouts_per_s += cost.rollouts_per_s / kNumSeeds;
    mean.simulations += cost.simulations / kNumSeeds;
    mean.reissues += cost.reissues / kNumSeeds;
  }
  std::printf("  %4.0f us, %2.0f %% lost: %6.0f roll-outs/s, %.4f simulations, %.3f re-issues\n",
              1e6 * to_seconds(rollout_time), 100 * loss, mean.rollouts_per_s, mean.simulations,
              mean.reissues);
  return mean;
}

void expect_little_cost(Duration rollout_time, int num_rollouts_each, double tenth_min) {
  const Cost whole = mean_cost(rollout_time, num_rollouts_each, 0);
  const Cost tenth = mean_cost(rollout_time, num_rollouts_each, .1);
  const Cost third = mean_cost(rollout_time, num_rollouts_each, .3);
  EXPECT_EQ(whole.reissues, 0);
  EXPECT_GE(tenth.rollouts_per_s, tenth_min * whole.rollouts_per_s);
  EXPECT_GE(third.rollouts_per_s, .6 * whole.rollouts_per_s);
  EXPECT_LE(third.simulations, 1.05);
}

TEST(LossTest, ShortRolloutsHardlyWaitForWhatIsLost) {
  // Greetings and definitions that are lost at the start cost a tenth of a second, which is a tenth
  // of all.
  expect_little_cost(microseconds(50), 2000, .78);
}

TEST(LossTest, LongRolloutsHardlyWaitForWhatIsLost) {
  expect_little_cost(milliseconds(3), 200, .9);
}

}  // namespace
}  // namespace treeroll::simulation
