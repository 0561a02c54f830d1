// The same cluster with keys, and a stranger who hears everything and says what he likes.
#include <gtest/gtest.h>

#include <cstdlib>

#include "common/protocol/timings.h"
#include "tests/simulation/seeds_run.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint64_t kNumKeySeeds = 1'000;
constexpr std::uint64_t kNumKeyParts = 2;

class KeysTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, KeysTest, ::testing::Range<std::uint64_t>(0, kNumKeyParts));

TEST_P(KeysTest, WhateverStrangersSayTheResultIsTheSame) {
  SeedsRun run = run_seeds(seeds(kNumKeySeeds, {GetParam(), kNumKeyParts}), "*StrangersSay*",
                           [](std::uint64_t seed) {
                             const Scenario faulty = scenario_of(seed);
                             return with_keys(seed % 3 == 0 ? with_relays(faulty) : faulty);
                           });
  if (std::getenv("TREEROLL_SIMULATION_SEED") == nullptr) {
    EXPECT_GT(run.faults["messages of strangers"], 0);
  }
}

/// A calm network with keys and without strangers does as much as one without keys.
TEST(CalmKeysTest, NothingIsIssuedAgainOrSimulatedTwice) {
  expect_no_waste(seeds(200), "CalmKeysTest.*", [](std::uint64_t seed) {
    Scenario scenario = calm_scenario(seed);
    scenario.has_keys = true;
    return scenario;
  });
}

/// Strangers cost at most half the time more, and none of the result. A study of 20 ms is as long
/// as the dice have its few answers wait: two of them may wait once more.
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
    const Duration dice = 2 * protocol::kAnswerDelayMax;
    EXPECT_LE(to_seconds(crowded.end() - TimePoint{}),
              1.5 * to_seconds(calm.end() - TimePoint{}) + to_seconds(dice))
        << repeat_command(seed, "CalmKeysTest.*");
  }
}

}  // namespace
}  // namespace treeroll::simulation
