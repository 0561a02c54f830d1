// What the service costs, where little or nothing goes wrong.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/simulation/seeds_run.h"

namespace treeroll::simulation {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::uint64_t kNumCalmSeeds = 1000;

TEST(CalmTest, IssuesNothingAgainWhereNothingIsLost) {
  expect_no_waste(seeds(kNumCalmSeeds), "CalmTest.IssuesNothingAgainWhereNothingIsLost",
                  calm_scenario);
}

/// Many runs over sixteen evaluators that answer at once, in frames of a network.
Scenario crowded_scenario(std::uint64_t seed) {
  Scenario scenario = calm_scenario(seed);
  scenario.studies[0].repetitions = 20;
  scenario.batch_bytes_max = 1400;
  scenario.task = {};
  scenario.workers.assign(1, {TimePoint{}, 16});
  return scenario;
}

TEST(CalmTest, IssuesNothingAgainWhereAnswersFillManySmallMessages) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Scenario scenario = crowded_scenario(seed);
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation() << ", seed " << seed;
    EXPECT_EQ(seen.num_reissued, 0) << "seed " << seed;
  }
}

TEST(CalmTest, AtThirtyPercentLossHardlyARolloutIsSimulatedTwice) {
  std::int64_t num_wanted = 0;
  std::int64_t num_simulations = 0;
  std::int64_t num_reissued = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Scenario scenario = calm_scenario(seed);
    scenario.network.loss = .3;
    scenario.task.duration_min = milliseconds(20);
    scenario.task.duration_max = milliseconds(60);
    scenario.faults_end = TimePoint(hours(1));
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation() << ", seed " << seed;
    num_wanted += num_rollouts(scenario) + 2 * num_runs(scenario);
    num_simulations += seen.num_simulations;
    num_reissued += seen.num_reissued;
  }
  const double simulations = static_cast<double>(num_simulations) / static_cast<double>(num_wanted);
  const double reissues = static_cast<double>(num_reissued) / static_cast<double>(num_wanted);
  std::printf("  at 30 %% loss: %.4f simulations and %.3f re-issues a roll-out\n", simulations,
              reissues);
  EXPECT_GT(num_reissued, 0);
  EXPECT_LE(simulations, 1.05);
  EXPECT_LE(reissues, 2);
}

}  // namespace
}  // namespace treeroll::simulation
