#include <benchmark/benchmark.h>

#include "common/policy/kinds/standard_policies.h"
#include "common/policy/policy.h"
#include "tests/benchmarks/shipped_study.h"

namespace treeroll::benchmarks {
namespace {

constexpr int kNumThetas = 64;

PolicyPtr start_of(const char* study, std::size_t condition) {
  return shipped_study(study).conditions.at(condition).start;
}

/// A roll-out's policy out of its theta: what an evaluator does before it simulates.
void with_theta(benchmark::State& state, const char* study, std::size_t condition) {
  const PolicyPtr policy = start_of(study, condition);
  const std::vector<Eigen::VectorXd> thetas = thetas_about(*policy, kNumThetas);
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(policy->with(thetas[next++ % kNumThetas])->controller());
  }
  state.counters["theta"] = policy->theta_dim();
}

/// One question of a simulation step.
void act(benchmark::State& state, const char* study, std::size_t condition) {
  const PolicyPtr policy = start_of(study, condition);
  const std::unique_ptr<Controller> controller = policy->controller();
  std::vector<double> input(static_cast<std::size_t>(policy->input_dim()));
  std::vector<double> output(static_cast<std::size_t>(policy->output_dim()));
  controller->start();
  int step = 0;
  for (auto _ : state) {
    input[0] = 1e-2 * (step++ % 200);
    controller->act(input, output);
    benchmark::DoNotOptimize(output.data());
  }
}

/// A run has a policy of its own after each switch: it is written, and read by each evaluator.
void text_round_trip(benchmark::State& state, const char* study, std::size_t condition) {
  const PolicyPtr policy = start_of(study, condition);
  const PolicyRegistry kinds = standard_policies();
  std::size_t bytes = 0;
  for (auto _ : state) {
    const std::string text = to_json(*policy);
    bytes = text.size();
    benchmark::DoNotOptimize(kinds.from_json(text));
  }
  state.counters["bytes"] = static_cast<double>(bytes);
}

#define TREEROLL_POLICY_BENCHMARKS(name, ...)                                         \
  BENCHMARK_CAPTURE(with_theta, name, __VA_ARGS__)->Name("policy/with_theta/" #name); \
  BENCHMARK_CAPTURE(act, name, __VA_ARGS__)->Name("policy/act/" #name);               \
  BENCHMARK_CAPTURE(text_round_trip, name, __VA_ARGS__)->Name("policy/text/" #name)

TREEROLL_POLICY_BENCHMARKS(swing_up, "swing_up", 0);      // a tree: 2 Gaussians over 4
TREEROLL_POLICY_BENCHMARKS(hold, "hold", 1);              // 6 inputs
TREEROLL_POLICY_BENCHMARKS(trajectory, "thesis_4_1", 0);  // means alone
TREEROLL_POLICY_BENCHMARKS(spiral, "spiral", 0);          // 2 outputs

}  // namespace
}  // namespace treeroll::benchmarks
