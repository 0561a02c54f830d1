#include "common/numbers/random_stream.h"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

#include "common/numbers/elementary.h"

namespace treeroll {

RandomStream::RandomStream(std::uint64_t seed, std::uint32_t repetition, std::uint32_t rollout,
                           RandomPurpose purpose)
    : key_{seed, repetition}, counter_{0, rollout, static_cast<std::uint64_t>(purpose), 0} {}

std::uint64_t RandomStream::next_bits() {
  if (used_ == 4) {
    const r123::Philox4x64 generate;
    const auto block =
        generate({{counter_[0], counter_[1], counter_[2], counter_[3]}}, {{key_[0], key_[1]}});
    block_ = {block[0], block[1], block[2], block[3]};
    ++counter_[0];
    used_ = 0;
  }
  return block_[used_++];
}

double RandomStream::next_uniform() {
  return (static_cast<double>(next_bits() >> 11) + 0.5) * 0x1p-53;
}

double RandomStream::next_normal() {
  if (has_spare_normal_) {
    has_spare_normal_ = false;
    return spare_normal_;
  }
  const double radius = std::sqrt(-2.0 * elementary::log(next_uniform()));
  const double angle = 2.0 * std::numbers::pi * next_uniform();
  spare_normal_ = radius * elementary::sin(angle);
  has_spare_normal_ = true;
  return radius * elementary::cos(angle);
}

}  // namespace treeroll
