#include "tests/simulation/simulation.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/simulation/seeds_run.h"

namespace treeroll::simulation {
namespace {

/// A minute of processor time with those of relays; TREEROLL_SIMULATION_SEEDS asks for more.
constexpr std::uint64_t kNumSeeds = 6'000;
constexpr std::uint64_t kNumParts = 4;

class MixOfFaultsTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, MixOfFaultsTest, ::testing::Range<std::uint64_t>(0, kNumParts));

TEST_P(MixOfFaultsTest, NothingIsLostAndNothingCountedTwice) {
  const SeedsRun run =
      run_seeds(seeds(kNumSeeds, {GetParam(), kNumParts}), "*NothingIsLost*", scenario_of);
  std::printf("  roll-outs %lld, simulations %lld, re-issues %lld\n",
              static_cast<long long>(run.num_rollouts), static_cast<long long>(run.num_simulations),
              static_cast<long long>(run.num_reissued));
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
