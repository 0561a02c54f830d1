#include <benchmark/benchmark.h>

#include "learner/journal/journal_fold.h"
#include "tests/benchmarks/learner_loop.h"
#include "tests/benchmarks/shipped_study.h"

namespace treeroll::benchmarks {
namespace {

constexpr std::int64_t kRecords = 20'000;

AcceptedResult result(std::int32_t number) {
  return {.key = {.run = 3, .number = number},
          .content = 1234567 + number,
          .outcome = Outcome::ok(.5),
          .worker_id = 5,
          .duration_ns = 1'000'000};
}

/// One record, and its share of the write(2). Argument: records a write.
void append(benchmark::State& state) {
  const ScratchFolder folder;
  JournalWriter journal(folder.path() / "journal.lcmlog");
  journal.append(JournalStart{}, 0);
  std::int32_t number = 0;
  for (auto _ : state) {
    journal.append(result(number++), 0);
    if (number % state.range(0) == 0) journal.flush();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(append)->Name("journal/append")->ArgName("a_write")->Arg(1)->Arg(16)->Arg(64);

/// A journal that was learnt, and the study it is of.
struct Learnt {
  Learnt() {
    LearnerLoop loop(study, {.results_a_message = 64, .messages_a_turn = 1}, journal);
    loop.learn(kRecords);
  }
  ScratchFolder folder;
  std::filesystem::path journal = folder.path() / "journal.lcmlog";
  Study study = cluster_study();
};

/// Records are read and their checks made.
void read(benchmark::State& state) {
  const Learnt learnt;
  std::int64_t num_records = 0;
  for (auto _ : state) {
    const auto tail = read_journal(learnt.journal, [](const JournalRecord&) {});
    num_records = tail->num_records;
  }
  state.SetItemsProcessed(state.iterations() * num_records);
}
BENCHMARK(read)->Name("journal/read")->Unit(benchmark::kMillisecond);

/// Each perturbation is drawn and each update made again: what --resume and --verify wait for.
void fold(benchmark::State& state) {
  const Learnt learnt;
  std::int64_t num_records = 0;
  for (auto _ : state) {
    learner::LearnerSettings settings;
    settings.learner_id = 78;
    learner::LearnerCore core(learnt.study, settings);
    num_records =
        fold_journal(learnt.journal,
                     {.id = LearnerLoop::study_id(), .repetitions = learnt.study.repetitions},
                     TimePoint{}, core)
            .num_records;
  }
  state.SetItemsProcessed(state.iterations() * num_records);
}
BENCHMARK(fold)->Name("journal/fold")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace treeroll::benchmarks
