#include "tests/simulation/simulation.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>

#include "tests/simulation/seeds.h"

namespace treeroll::simulation {
namespace {

/// A minute of processor time with those of relays; TREEROLL_SIMULATION_SEEDS asks for more.
constexpr std::uint64_t kNumSeeds = 6'000;
constexpr std::uint64_t kNumParts = 4;

class MixOfFaultsTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, MixOfFaultsTest, ::testing::Range<std::uint64_t>(0, kNumParts));

TEST_P(MixOfFaultsTest, NothingIsLostAndNothingCountedTwice) {
  std::map<std::string, std::int64_t> faults;
  std::int64_t num_rollouts_in_all = 0;
  std::int64_t num_simulations = 0;
  std::int64_t num_reissued = 0;
  int num_failures = 0;
  for (const std::uint64_t seed : seeds(kNumSeeds, {GetParam(), kNumParts})) {
    const Scenario scenario = scenario_of(seed);
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation()
                                << "\n  repeat: " << repeat_command(seed, "*NothingIsLost*");
    for (const auto& [fault, times] : seen.faults()) faults[fault] += times;
    num_rollouts_in_all += num_rollouts(scenario);
    num_simulations += seen.num_simulations;
    num_reissued += seen.num_reissued;
    if (seen.broken() && ++num_failures == 10) break;
  }
  for (const auto& [fault, times] : faults) {
    std::printf("  %-36s %12lld\n", fault.c_str(), static_cast<long long>(times));
  }
  std::printf("  roll-outs %lld, simulations %lld, re-issues %lld\n",
              static_cast<long long>(num_rollouts_in_all), static_cast<long long>(num_simulations),
              static_cast<long long>(num_reissued));
}

TEST(SimulationTest, ASeedIsRepeatedToTheBit) {
  for (const std::uint64_t seed : {3U, 14U, 15U}) {
    const Scenario scenario = scenario_of(seed);
    Simulation one(scenario);
    Simulation two(scenario);
    one.run();
    two.run();
    EXPECT_EQ(one.end(), two.end());
    EXPECT_EQ(one.observer().faults(), two.observer().faults());
    EXPECT_EQ(one.observer().num_simulations, two.observer().num_simulations);
  }
}

}  // namespace
}  // namespace treeroll::simulation
