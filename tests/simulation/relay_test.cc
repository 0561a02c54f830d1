// The same cluster with relays between the learners and most of the workers.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>

#include "tests/simulation/seeds.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint64_t kNumRelaySeeds = 2'000;
constexpr std::uint64_t kNumCalmRelaySeeds = 300;
constexpr std::uint64_t kNumRelayParts = 2;

class RelayFaultsTest : public ::testing::TestWithParam<std::uint64_t> {};

INSTANTIATE_TEST_SUITE_P(Part, RelayFaultsTest, ::testing::Range<std::uint64_t>(0, kNumRelayParts));

TEST_P(RelayFaultsTest, ThroughRelaysThatComeAndGoTheResultIsTheSame) {
  std::map<std::string, std::int64_t> faults;
  int num_failures = 0;
  for (const std::uint64_t seed : seeds(kNumRelaySeeds, {GetParam(), kNumRelayParts})) {
    const Scenario scenario = with_relays(scenario_of(seed));
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation()
                                << "\n  repeat: " << repeat_command(seed, "*ComeAndGo*");
    for (const auto& [fault, times] : seen.faults()) faults[fault] += times;
    if (seen.broken() && ++num_failures == 10) break;
  }
  for (const auto& [fault, times] : faults) {
    std::printf("  %-36s %12lld\n", fault.c_str(), static_cast<long long>(times));
  }
  if (std::getenv("TREEROLL_SIMULATION_SEED") != nullptr) return;
  for (const char* one : {"relay crashes", "relays drained", "relays stopped for a while"}) {
    EXPECT_GT(faults[one], 0) << one;
  }
}

TEST(RelayTest, NothingIsIssuedAgainOrSimulatedTwiceWhereNothingIsLost) {
  for (const std::uint64_t seed : seeds(kNumCalmRelaySeeds)) {
    const Scenario scenario = with_relays(calm_scenario(seed));
    Simulation simulation(scenario);
    simulation.run();
    const Observer& seen = simulation.observer();
    EXPECT_FALSE(seen.broken()) << seen.violation();
    EXPECT_EQ(seen.num_reissued, 0);
    EXPECT_EQ(seen.num_simulations, num_rollouts(scenario) + 2 * num_runs(scenario));
    if (::testing::Test::HasFailure()) {
      FAIL() << "repeat: " << repeat_command(seed, "RelayTest.NothingIsIssuedAgain*");
    }
  }
}

}  // namespace
}  // namespace treeroll::simulation
