#include <benchmark/benchmark.h>

#include "sim/plant_settings.h"
#include "tests/sim/swing_up_input.h"

namespace treeroll::benchmarks {
namespace {

/// A plant alone, without policy and reward: 2.5 s from hanging, for an input that costs
/// nothing.
void simulate(benchmark::State& state, const sim::PlantSettings& settings) {
  const std::unique_ptr<sim::CartPendulumPlant> plant = sim::make_plant(settings);
  const auto input = [](double, const sim::CartPendulumState&) { return 1.; };
  for (auto _ : state) {
    const auto end = plant->simulate(sim::kHanging, 2.5, input, sim::go_on);
    if (!end) {
      state.SkipWithError(end.error().message.c_str());
      break;
    }
    benchmark::DoNotOptimize(end->phi1);
  }
}

BENCHMARK_CAPTURE(simulate, ode,
                  sim::PlantSettings{
                      .kind = sim::PlantKind::kOde, .step_s = 1e-3, .dopri5 = {}, .parameters = {}})
    ->Name("plant/ode_1ms")
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(simulate, rk4,
                  sim::PlantSettings{
                      .kind = sim::PlantKind::kRk4, .step_s = 5e-3, .dopri5 = {}, .parameters = {}})
    ->Name("plant/rk4_5ms")
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(simulate, dopri5,
                  sim::PlantSettings{
                      .kind = sim::PlantKind::kDopri5, .step_s = 0, .dopri5 = {}, .parameters = {}})
    ->Name("plant/dopri5")
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace treeroll::benchmarks
