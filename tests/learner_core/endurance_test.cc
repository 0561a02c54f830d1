// What the learner holds does not grow with the roll-outs behind it, but for their records.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/learner_core/cluster.h"

namespace treeroll::learner {
namespace {

constexpr int kRepetitions = 10;
constexpr int kInFlight = 2;
constexpr std::size_t kSlackBytes = 256 << 10;

/// What malloc has given out in this process, Eigen's and the library's memory included.
std::size_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// TREEROLL_ROLLOUTS_PER_RUN asks for more.
int rollouts_per_run() {
  const char* many = std::getenv("TREEROLL_ROLLOUTS_PER_RUN");
  return many ? std::stoi(many) : 20'000;
}

TEST(EnduranceTest, MemoryIsFlatAfterWarmUpAndQueuesAreBounded) {
  const std::size_t empty_bytes = heap_bytes();
  if (empty_bytes == 0) GTEST_SKIP() << "this allocator does not count: a sanitizer's";
  const int num_rollouts = rollouts_per_run();
  const std::int64_t total = std::int64_t{kRepetitions} * num_rollouts;
  Cluster cluster(small_study(num_rollouts, kRepetitions, kInFlight));
  cluster.loss = .02;
  for (const int id : {1, 2, 3, 4}) cluster.add_worker(id, std::chrono::milliseconds(id));
  cluster.start();

  std::size_t warm_bytes = 0;
  std::size_t most_bytes = 0;
  std::size_t most_open = 0;
  cluster.run(std::chrono::hours(24 * 365), [&] {
    cluster.sent.clear();
    cluster.journal.clear();
    cluster.log.clear();
    const Ledger& ledger = cluster.core->ledger();
    most_open = std::max(most_open, ledger.ready().size() + ledger.num_leased());
    const std::int64_t applied = cluster.core->counters().applied;
    if (applied < total / 10) return;
    const std::size_t bytes = applied % 1000 == 0 ? heap_bytes() : most_bytes;
    if (warm_bytes == 0) warm_bytes = bytes;
    most_bytes = std::max(most_bytes, bytes);
  });
  EXPECT_EQ(cluster.core->outcome(), LearnerCore::Outcome::kDone);
  EXPECT_EQ(cluster.core->counters().applied, total);
  EXPECT_GT(cluster.core->counters().reissued, 0);
  EXPECT_LE(most_open, std::size_t{kRepetitions} * (kInFlight + 1)) << "with the starts";
  EXPECT_GT(warm_bytes, 0U);
  EXPECT_LE(most_bytes, warm_bytes + kSlackBytes);
  EXPECT_LE(warm_bytes, empty_bytes + total * sizeof(RolloutRecord) + 4 * kSlackBytes);
  std::printf(
      "  %lld roll-outs in %d runs: heap %.2f MB after a tenth, at most %.2f MB then; "
      "records are %zu B a roll-out\n",
      static_cast<long long>(total), kRepetitions, static_cast<double>(warm_bytes) / 1e6,
      static_cast<double>(most_bytes) / 1e6, sizeof(RolloutRecord));
}

}  // namespace
}  // namespace treeroll::learner
