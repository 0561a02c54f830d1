#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

namespace treeroll::simulation {

/// One part of the seeds of a test, so that a machine's cores share them.
struct Part {
  std::uint64_t index = 0;
  std::uint64_t count = 1;
};

/// The seeds of a part: TREEROLL_SIMULATION_SEED is the one to repeat, TREEROLL_SIMULATION_SEEDS
/// how many there are in all, else `count`; from TREEROLL_SIMULATION_FIRST on, else 1, so that a
/// long run can be done piece by piece. With TREEROLL_SIMULATION_FRESH=N the second half begins at
/// N: `deploy/test` takes it from the commit, so that every change meets new ones.
inline std::vector<std::uint64_t> seeds(std::uint64_t count, Part part = {}) {
  if (const char* one = std::getenv("TREEROLL_SIMULATION_SEED")) {
    const std::uint64_t seed = std::stoull(one);
    if (seed % part.count != part.index) return {};
    return {seed};
  }
  if (const char* many = std::getenv("TREEROLL_SIMULATION_SEEDS")) count = std::stoull(many);
  const char* begin = std::getenv("TREEROLL_SIMULATION_FIRST");
  const std::uint64_t first = begin != nullptr ? std::stoull(begin) : 1;
  const char* fresh = std::getenv("TREEROLL_SIMULATION_FRESH");
  const std::uint64_t num_known = fresh != nullptr ? count - count / 2 : count;
  const std::uint64_t first_fresh = fresh != nullptr ? std::stoull(fresh) : 0;
  std::vector<std::uint64_t> mine;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t seed = i < num_known ? first + i : first_fresh + (i - num_known);
    if (seed % part.count == part.index) mine.push_back(seed);
  }
  return mine;
}

inline std::string repeat_command(std::uint64_t seed, const std::string& test) {
  return "TREEROLL_SIMULATION_SEED=" + std::to_string(seed) +
         " build/dev/bin/simulation_test --gtest_filter='" + test + "'";
}

}  // namespace treeroll::simulation
