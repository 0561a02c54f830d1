#pragma once

#include <array>
#include <cstdint>

namespace treeroll {

/// What a stream of random numbers is for: streams of different purposes are independent.
enum class RandomPurpose : std::uint32_t {
  kPerturbation = 0,  ///< exploration noise of a roll-out
  kTaskSeed = 1,      ///< seed handed to a task that is not deterministic
  kPopulation = 2,    ///< draws of an update rule beyond the perturbation of one roll-out
  kFit = 3,           ///< start of a fit to a demonstration
  kRecheck = 4,       ///< whether a roll-out is run again on another worker
};

/// Random numbers as a pure function of their key: the counter-based generator Philox4x64-10
/// (Salmon et al. 2011). There is no state to save, and two conditions of a study that share seed
/// and repetition share their draws. The condition is deliberately not part of the key.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint32_t repetition, std::uint32_t rollout,
               RandomPurpose purpose);

  std::uint64_t next_bits();
  /// Uniform in the open interval (0, 1), 53 bits.
  double next_uniform();
  /// Standard normal, by Box and Muller's transform in the portable functions of elementary.h.
  double next_normal();

 private:
  std::array<std::uint64_t, 2> key_;
  std::array<std::uint64_t, 4> counter_;
  std::array<std::uint64_t, 4> block_{};
  int used_ = 4;
  double spare_normal_ = 0;
  bool has_spare_normal_ = false;
};

}  // namespace treeroll
