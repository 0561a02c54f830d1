#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

namespace treeroll::simulation {

/// The seeds of a test: TREEROLL_SIMULATION_SEED is the one to repeat, TREEROLL_SIMULATION_SEEDS
/// how many; else 1 .. `count`.
inline std::vector<std::uint64_t> seeds(std::uint64_t count) {
  if (const char* one = std::getenv("TREEROLL_SIMULATION_SEED")) return {std::stoull(one)};
  if (const char* many = std::getenv("TREEROLL_SIMULATION_SEEDS")) count = std::stoull(many);
  std::vector<std::uint64_t> all;
  for (std::uint64_t seed = 1; seed <= count; ++seed) all.push_back(seed);
  return all;
}

inline std::string repeat_command(std::uint64_t seed, const std::string& test) {
  return "TREEROLL_SIMULATION_SEED=" + std::to_string(seed) +
         " build/dev/bin/simulation_test --gtest_filter=" + test;
}

}  // namespace treeroll::simulation
