// The same cluster with keys, and a stranger who hears everything and says what he likes.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>

#include "tests/simulation/seeds.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint64_t kNumKeySeeds = 1'000;
constexpr std::uint64_t kNumKeyParts = 2;

class KeysTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, KeysTest, ::testing::Range<std::uint64_t>(0, kNumKeyParts));

TEST_P(KeysTest, WhateverStrangersSayTheResultIsTheSame) {
  std::map<std::string, std::int64_t> faults;
  int num_failures = 0;
  for (const std::uint64_t seed : seeds(kNumKeySeeds, {GetParam(), kNumKeyParts})) {
    const Scenario faulty = scenario_of(seed);
    const Scenario scenario = with_keys(seed % 3 == 0 ? with_relays(faulty) : faulty);
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation()
                                << "\n  repeat: " << repeat_command(seed, "*StrangersSay*");
    for (const auto& [fault, times] : seen.faults()) faults[fault] += times;
    if (seen.broken() && ++num_failures == 10) break;
  }
  for (const auto& [fault, times] : faults) {
    std::printf("  %-36s %12lld\n", fault.c_str(), static_cast<long long>(times));
  }
  if (std::getenv("TREEROLL_SIMULATION_SEED") == nullptr) {
    EXPECT_GT(faults["messages of strangers"], 0);
  }
}

/// A calm network with keys and without strangers does as much as one without keys.
TEST(CalmKeysTest, NothingIsIssuedAgainOrSimulatedTwice) {
  for (const std::uint64_t seed : seeds(200)) {
    Scenario scenario = calm_scenario(seed);
    scenario.has_keys = true;
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation();
    EXPECT_EQ(seen.num_reissued, 0);
    EXPECT_EQ(seen.num_simulations, num_rollouts(scenario) + 2 * num_runs(scenario));
    if (::testing::Test::HasFailure()) {
      FAIL() << "repeat: " << repeat_command(seed, "CalmKeysTest.*");
    }
  }
}

/// Strangers cost at most half the time more, and none of the result.
TEST(CalmKeysTest, StrangersCostAtMostHalfTheTimeMore) {
  for (const std::uint64_t seed : seeds(100)) {
    Scenario scenario = calm_scenario(seed);
    scenario.has_keys = true;
    Simulation calm(scenario);
    calm.run();
    scenario.stranger_share = .3;
    Simulation crowded(scenario);
    crowded.run();
    EXPECT_FALSE(crowded.observer().broken()) << crowded.observer().violation();
    EXPECT_LE(to_seconds(crowded.end() - TimePoint{}), 1.5 * to_seconds(calm.end() - TimePoint{}))
        << repeat_command(seed, "CalmKeysTest.*");
  }
}

}  // namespace
}  // namespace treeroll::simulation
