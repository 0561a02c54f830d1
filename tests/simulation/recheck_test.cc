// The same cluster where a share of the roll-outs is run again on another worker; then with a
// worker that lies now and then.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/simulation/seeds_run.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint64_t kNumRecheckSeeds = 800;
constexpr std::uint64_t kNumRecheckParts = 2;

class RecheckTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, RecheckTest, ::testing::Range<std::uint64_t>(0, kNumRecheckParts));

bool is_one_seed() { return std::getenv("TREEROLL_SIMULATION_SEED") != nullptr; }

TEST_P(RecheckTest, WhatIsRunAgainChangesNothingThatIsLearnt) {
  SeedsRun run = run_seeds(seeds(kNumRecheckSeeds, {GetParam(), kNumRecheckParts}),
                           "*RunAgainChanges*", [](std::uint64_t seed) {
                             Scenario scenario = with_rechecks(scenario_of(seed));
                             if (seed % 5 == 0) scenario = with_relays(std::move(scenario));
                             return seed % 3 == 0 ? with_keys(std::move(scenario)) : scenario;
                           });
  if (is_one_seed()) return;
  EXPECT_GT(run.faults["second answers"], 0);
  EXPECT_EQ(run.faults["of these disputed"], 0);
  EXPECT_GT(run.faults["asked again on another host"], 0);
  EXPECT_GT(run.faults["asked again on one host"], 0);
  EXPECT_GT(run.faults["names of signals noted"], 0);
}

TEST_P(RecheckTest, WhoLiesIsFoundAndTheStudyStandsWithoutHim) {
  SeedsRun run = run_seeds(seeds(kNumRecheckSeeds, {GetParam(), kNumRecheckParts}), "*WhoLies*",
                           [](std::uint64_t seed) {
                             Scenario scenario = with_liar(scenario_of(seed));
                             return seed % 2 == 0 ? with_keys(std::move(scenario)) : scenario;
                           });
  if (is_one_seed()) return;
  EXPECT_GT(run.faults["lies"], 0);
  EXPECT_GT(run.faults["workers outvoted"], 0);
  EXPECT_GT(run.faults["of these replaced by a second answer"], 0);
}

/// On a calm network with three workers or more nobody who lies often goes unfound.
TEST(CalmLiarTest, WhoLiesHalfOfTheTimeIsFoundByATenthOfTheRollOuts) {
  int num_found = 0;
  int num_liars = 0;
  for (const std::uint64_t seed : seeds(100)) {
    Scenario scenario = with_liar(calm_scenario(seed));
    scenario.has_keys = true;
    scenario.lying_share = .5;
    for (Study& study : scenario.studies) study.recheck = .1;
    Simulation simulation(scenario);
    simulation.run();
    EXPECT_FALSE(simulation.observer().broken())
        << simulation.observer().violation() << repeat_command(seed, "CalmLiarTest.*");
    const auto& seen = simulation.observer().faults();
    const auto lies = seen.find("lies");
    // Who has said a few things only may have been lucky.
    if (lies == seen.end() || lies->second < 10) continue;
    ++num_liars;
    const auto outvoted = seen.find("workers outvoted");
    num_found += outvoted != seen.end() && outvoted->second > 0 ? 1 : 0;
  }
  if (is_one_seed()) return;
  EXPECT_GT(num_liars, 20);
  EXPECT_GE(num_found, .6 * num_liars);
}

}  // namespace
}  // namespace treeroll::simulation
