#include <benchmark/benchmark.h>

#include "common/mixture/gmr.h"
#include "tests/mixture/random_mixture.h"

namespace treeroll::benchmarks {
namespace {

/// Inputs spread over the mixture, so that no weight is always 0 or 1.
constexpr int kNumInputs = 256;

/// Arguments: inputs, outputs, Gaussians.
void regression(benchmark::State& state) {
  const auto input_dim = static_cast<int>(state.range(0));
  const auto output_dim = static_cast<int>(state.range(1));
  test::RandomMixture random(3);
  const Gmr gmr(random.gmm(input_dim, input_dim + output_dim, static_cast<int>(state.range(2))));
  std::vector<Eigen::VectorXd> inputs;
  for (int i = 0; i < kNumInputs; ++i) inputs.push_back(3 * random.vector(input_dim));
  Gmr::WorkSpace work = gmr.work_space();
  Eigen::VectorXd output(output_dim);
  std::size_t next = 0;
  for (auto _ : state) {
    const Eigen::VectorXd& input = inputs[next++ % kNumInputs];
    gmr.regress({input.data(), static_cast<std::size_t>(input_dim)}, work,
                {output.data(), static_cast<std::size_t>(output_dim)});
    benchmark::DoNotOptimize(output.data());
  }
}
BENCHMARK(regression)
    ->Name("mixture/regression")
    ->ArgNames({"in", "out", "gaussians"})
    ->Args({1, 1, 4})
    ->Args({1, 1, 16})
    ->Args({1, 2, 6})
    ->Args({6, 1, 2});

/// What has to be made once a roll-out. Argument: Gaussians.
void preparation(benchmark::State& state) {
  const Gmm gmm = test::RandomMixture(3).gmm(1, 2, static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(Gmr(gmm));
}
BENCHMARK(preparation)->Name("mixture/preparation")->ArgName("gaussians")->Arg(4)->Arg(16);

}  // namespace
}  // namespace treeroll::benchmarks
