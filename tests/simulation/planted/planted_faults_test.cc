// Each planted fault is caught: what the simulation's rules are worth.
#include <gtest/gtest.h>

#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/simulation/planted_fault.h"
#include "tests/simulation/simulation.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint64_t kSeedsMax = 5000;

const std::vector<std::string> kFaults = {
#include "planted_faults.inc"
};

/// The broken rule, or nothing. Faults of relays need relays.
std::string violation_of(std::uint64_t seed, bool has_relays) {
  PlantedFault::memory = 0;
  const Scenario drawn = scenario_of(seed);
  const Scenario scenario = has_relays ? with_relays(drawn) : drawn;
  Simulation simulation(scenario);
  simulation.run();
  return simulation.observer().violation();
}

struct Catch {
  std::uint64_t seed = 0;
  std::string violation;
};

std::optional<Catch> first_catch(const std::string& fault) {
  PlantedFault::active = fault;
  std::optional<Catch> caught;
  for (std::uint64_t seed = 1; seed <= kSeedsMax && !caught; ++seed) {
    std::string violation = violation_of(seed, fault.starts_with("relay: "));
    if (!violation.empty()) caught = {seed, std::move(violation)};
  }
  PlantedFault::active.clear();
  return caught;
}

TEST(PlantedFaultsTest, EachIsCaught) {
  std::printf("  %-46s %6s  %s\n", "planted fault", "seeds", "broken rule");
  for (const std::string& fault : kFaults) {
    const std::optional<Catch> caught = first_catch(fault);
    EXPECT_TRUE(caught) << fault << ": not caught in " << kSeedsMax << " seeds";
    if (!caught) continue;
    std::printf("  %-46s %6d  %s\n", fault.c_str(), static_cast<int>(caught->seed),
                caught->violation.c_str());
    std::fflush(stdout);
  }
}

TEST(PlantedFaultsTest, WithoutOneTheCopyBreaksNoRule) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    EXPECT_EQ(violation_of(seed, false), "") << seed;
    EXPECT_EQ(violation_of(seed, true), "") << seed;
  }
}

}  // namespace
}  // namespace treeroll::simulation
