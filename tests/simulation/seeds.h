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
/// how many there are in all; else 1 .. `count`.
inline std::vector<std::uint64_t> seeds(std::uint64_t count, Part part = {}) {
  std::uint64_t first = 1;
  if (const char* one = std::getenv("TREEROLL_SIMULATION_SEED")) {
    first = count = std::stoull(one);
  } else if (const char* many = std::getenv("TREEROLL_SIMULATION_SEEDS")) {
    count = std::stoull(many);
  }
  std::vector<std::uint64_t> mine;
  for (std::uint64_t seed = first; seed <= count; ++seed) {
    if (seed % part.count == part.index) mine.push_back(seed);
  }
  return mine;
}

inline std::string repeat_command(std::uint64_t seed, const std::string& test) {
  return "TREEROLL_SIMULATION_SEED=" + std::to_string(seed) +
         " build/dev/bin/simulation_test --gtest_filter='" + test + "'";
}

}  // namespace treeroll::simulation
