#pragma once

#include <cstdint>

#include "common/base/time.h"
#include "common/numbers/random_stream.h"

namespace treeroll::simulation {

/// Chance of a simulation: a pure function of the seed, of who throws and of what for.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint32_t who, std::uint32_t what = 0)
      : stream_(seed, who, what, RandomPurpose::kPopulation) {}

  bool chance(double probability) { return stream_.next_uniform() < probability; }
  double between(double min, double max) { return min + (max - min) * stream_.next_uniform(); }
  /// Both ends included.
  int between(int min, int max) {
    return min + static_cast<int>(stream_.next_bits() % static_cast<std::uint64_t>(max - min + 1));
  }
  Duration between(Duration min, Duration max) {
    const double ns = between(static_cast<double>(min.count()), static_cast<double>(max.count()));
    return Duration(static_cast<Duration::rep>(ns));
  }
  /// A name of a process: 63 bits, not 0.
  std::int64_t id() { return static_cast<std::int64_t>(stream_.next_bits() >> 1U) | 1; }

 private:
  RandomStream stream_;
};

}  // namespace treeroll::simulation
