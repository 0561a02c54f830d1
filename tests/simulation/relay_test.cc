// The same cluster with relays between the learners and most of the workers.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/simulation/seeds_run.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint64_t kNumRelaySeeds = 2'000;
constexpr std::uint64_t kNumCalmRelaySeeds = 300;
constexpr std::uint64_t kNumRelayParts = 2;

class RelayFaultsTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, RelayFaultsTest, ::testing::Range<std::uint64_t>(0, kNumRelayParts));

TEST_P(RelayFaultsTest, ThroughRelaysThatComeAndGoTheResultIsTheSame) {
  SeedsRun run = run_seeds(seeds(kNumRelaySeeds, {GetParam(), kNumRelayParts}), "*ComeAndGo*",
                           [](std::uint64_t seed) { return with_relays(scenario_of(seed)); });
  if (std::getenv("TREEROLL_SIMULATION_SEED") != nullptr) return;
  for (const char* one : {"relay crashes", "relays drained", "relays stopped for a while"}) {
    EXPECT_GT(run.faults[one], 0) << one;
  }
}

TEST(RelayTest, NothingIsIssuedAgainOrSimulatedTwiceWhereNothingIsLost) {
  expect_no_waste(seeds(kNumCalmRelaySeeds), "RelayTest.NothingIsIssuedAgain*",
                  [](std::uint64_t seed) { return with_relays(calm_scenario(seed)); });
}

}  // namespace
}  // namespace treeroll::simulation
