#include "sim/ode_canary.h"

#include <cstddef>
#include <cstring>

#include "common/base/check.h"
#include "common/base/content_hash.h"
#include "sim/ode_plant.h"

namespace treeroll::sim {
namespace {

constexpr double kDurationS = 2;
constexpr double kStepS = 1e-3;
constexpr std::size_t kShownDigits = 8;

/// Of the processor's arithmetic alone: the same everywhere.
double thrown_about(double time_s, const CartPendulumState& state) {
  return 8 - 12 * time_s + 3 * state.phi1_rate - 20 * state.y;
}

}  // namespace

std::string ode_canary() {
  OdePlant plant(DoublePendulum{}, kStepS);
  const CartPendulumState start{.phi1 = .7, .phi2 = -2.1, .y = .05, .phi1_rate = 1.5};
  std::string bits;
  const auto add = [&bits](double, const CartPendulumState& state, double) {
    std::byte bytes[sizeof state];
    std::memcpy(bytes, &state, sizeof state);
    bits.append(reinterpret_cast<const char*>(bytes), sizeof state);
    return true;
  };
  const Result<CartPendulumState> end = plant.simulate(start, kDurationS, thrown_about, add);
  CHECK(end, "the fixed motion does not diverge");
  return to_hex(content_hash(bits)).substr(0, kShownDigits);
}

}  // namespace treeroll::sim
