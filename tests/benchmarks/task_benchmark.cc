#include <benchmark/benchmark.h>

#include "tests/benchmarks/shipped_study.h"

namespace treeroll::benchmarks {
namespace {

constexpr int kThetasInTurn = 16;

/// Roll-outs as an evaluator executes them: the policy with theta, then the task. Argument: how
/// many together; time is that of all of them.
void roll_out(benchmark::State& state, const Condition& condition) {
  const std::unique_ptr<Task> task = task_of(condition);
  const std::vector<Eigen::VectorXd> thetas = thetas_about(*condition.start, kThetasInTurn);
  std::size_t next = 0;
  double sum = 0;
  for (auto _ : state) {
    std::vector<std::unique_ptr<Controller>> controllers;
    std::vector<Task::Evaluation> evaluations;
    for (std::int64_t i = 0; i < state.range(0); ++i) {
      controllers.push_back(condition.start->with(thetas[next++ % kThetasInTurn])->controller());
      evaluations.push_back({*controllers.back(), 0});
    }
    for (const Outcome& outcome : task->evaluate_all(evaluations)) {
      if (!outcome.is_ok()) {
        state.SkipWithError(("a roll-out has failed: " + outcome.reason()).c_str());
        return;
      }
      sum += outcome.reward();
    }
  }
  benchmark::DoNotOptimize(sum);
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void shipped(benchmark::State& state, const char* study) {
  roll_out(state, shipped_study(study).conditions.at(0));
}

/// The quickstart's policy on a plant. The task's other settings are those of the study.
void swing_up(benchmark::State& state, const std::string& plant) {
  Condition condition = shipped_study("swing_up").conditions.at(0);
  condition.task_content =
      R"({"name":"swing_up","settings":{"duration_s":2.5,"alpha":0.25,)" + plant + "}}";
  roll_out(state, condition);
}

void synthetic(benchmark::State& state) {
  roll_out(state, cluster_study({"task.duration_us=0"}).conditions.at(0));
}

BENCHMARK_CAPTURE(swing_up, ode, R"("plant":"ode","step_s":0.001)")
    ->Name("task/swing_up/ode_1ms")
    ->ArgName("together")
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(swing_up, rk4, R"("plant":"rk4","step_s":0.005)")
    ->Name("task/swing_up/rk4_5ms")
    ->ArgName("together")
    ->Arg(1)
    ->Arg(4)
    ->Arg(8)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(swing_up, dopri5, R"("plant":"dopri5")")
    ->Name("task/swing_up/dopri5")
    ->ArgName("together")
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(shipped, hold, "hold")
    ->Name("task/hold/rk4_5ms")
    ->ArgName("together")
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(shipped, trajectory, "thesis_4_1")
    ->Name("task/trajectory")
    ->ArgName("together")
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(shipped, spiral, "spiral")
    ->Name("task/spiral")
    ->ArgName("together")
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(synthetic)
    ->Name("task/synthetic/no_time")
    ->ArgName("together")
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace treeroll::benchmarks
