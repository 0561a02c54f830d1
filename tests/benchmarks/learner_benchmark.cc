#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>

#include "tests/benchmarks/learner_loop.h"
#include "tests/benchmarks/shipped_study.h"

namespace treeroll::benchmarks {
namespace {

/// Results between two looks at the clock of the benchmark.
constexpr std::int64_t kResultsAnIteration = 2048;

Study study_of(std::int64_t num_runs) {
  return cluster_study({"study.repetitions=" + std::to_string(num_runs), "study.rollouts=30000"});
}

void learn(benchmark::State& state, LearnerLoop& loop, std::int64_t history) {
  // Once every run has had an update, and windows are what the durations make them.
  loop.learn(std::max(history, 20 * static_cast<std::int64_t>(loop.num_runs())));
  const std::int64_t messages = loop.num_messages_sent();
  const std::int64_t bytes = loop.num_bytes_sent();
  const std::int64_t before = loop.num_results();
  for (auto _ : state) {
    state.SetIterationTime(std::chrono::duration<double>(loop.learn(kResultsAnIteration)).count());
  }
  const auto results = static_cast<double>(loop.num_results() - before);
  state.SetItemsProcessed(static_cast<std::int64_t>(results));
  state.counters["messages_sent_a_result"] =
      static_cast<double>(loop.num_messages_sent() - messages) / results;
  state.counters["bytes_sent_a_result"] =
      static_cast<double>(loop.num_bytes_sent() - bytes) / results;
}

/// Results through decoding, ledger, journal, update, draw and the encoded answer, on one core.
/// Arguments: results a message, messages before the learner answers.
void results(benchmark::State& state) {
  const ScratchFolder folder;
  LearnerLoop loop(study_of(64),
                   {.results_a_message = static_cast<int>(state.range(0)),
                    .messages_a_turn = static_cast<int>(state.range(1))},
                   folder.path() / "journal.lcmlog");
  learn(state, loop, 0);
}
BENCHMARK(results)
    ->Name("learner/results")
    ->ArgNames({"a_message", "messages"})
    ->Args({1, 1})
    ->Args({1, 64})
    ->Args({16, 4})
    ->Args({64, 1})
    ->Unit(benchmark::kMicrosecond)
    ->UseManualTime();

/// The cost of one result does not grow with the runs, nor with what has been learnt. Time is that
/// of 2048 results. Arguments: runs; results that have been learnt before.
void flatness(benchmark::State& state) {
  const ScratchFolder folder;
  LearnerLoop loop(study_of(state.range(0)), {.results_a_message = 16, .messages_a_turn = 4},
                   folder.path() / "journal.lcmlog");
  learn(state, loop, state.range(1));
}
BENCHMARK(flatness)
    ->Name("learner/flatness")
    ->ArgNames({"runs", "history"})
    ->Args({1, 0})
    ->Args({64, 0})
    ->Args({1000, 0})
    ->Args({3000, 0})
    ->Args({64, 10'000})
    ->Args({64, 100'000})
    ->Unit(benchmark::kMicrosecond)
    ->Iterations(8)
    ->UseManualTime();

}  // namespace
}  // namespace treeroll::benchmarks
