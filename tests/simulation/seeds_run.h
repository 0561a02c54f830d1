#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "tests/simulation/seeds.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {

/// What happened over all seeds of a test.
struct SeedsRun {
  std::map<std::string, std::int64_t> faults;  ///< how often each fired
  std::int64_t num_rollouts = 0;
  std::int64_t num_simulations = 0;
  std::int64_t num_reissued = 0;
};

/// Runs the scenario of each seed and prints how often each fault fired. A broken rule is a failure
/// that says how to repeat it; ten of them end the run.
/// @param filter  that names this test alone
template <class ScenarioOf>
SeedsRun run_seeds(const std::vector<std::uint64_t>& seeds, const std::string& filter,
                   const ScenarioOf& scenario_of_seed) {
  SeedsRun run;
  int num_failures = 0;
  for (const std::uint64_t seed : seeds) {
    const Scenario scenario = scenario_of_seed(seed);
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation()
                                << "\n  repeat: " << repeat_command(seed, filter);
    for (const auto& [fault, times] : seen.faults()) run.faults[fault] += times;
    run.num_rollouts += num_rollouts(scenario);
    run.num_simulations += seen.num_simulations;
    run.num_reissued += seen.num_reissued;
    if (seen.broken() && ++num_failures == 10) break;
  }
  for (const auto& [fault, times] : run.faults) {
    std::printf("  %-36s %12lld\n", fault.c_str(), static_cast<long long>(times));
  }
  return run;
}

/// Where nothing is lost each roll-out is issued and simulated once, and so are the start and the
/// final policy of each run. The first seed of which that is not true ends the test.
template <class ScenarioOf>
void expect_no_waste(const std::vector<std::uint64_t>& seeds, const std::string& filter,
                     const ScenarioOf& scenario_of_seed) {
  for (const std::uint64_t seed : seeds) {
    const Scenario scenario = scenario_of_seed(seed);
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation();
    EXPECT_EQ(seen.num_reissued, 0);
    EXPECT_EQ(seen.num_simulations, num_rollouts(scenario) + 2 * num_runs(scenario));
    if (::testing::Test::HasFailure()) FAIL() << "repeat: " << repeat_command(seed, filter);
  }
}

}  // namespace treeroll::simulation
