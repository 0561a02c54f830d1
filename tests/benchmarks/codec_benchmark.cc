#include <benchmark/benchmark.h>

#include "common/base/check.h"
#include "common/base/content_hash.h"
#include "common/transport/codec.h"

namespace treeroll::benchmarks {
namespace {

using protocol::Message;
using transport::Channel;

constexpr std::size_t kThetaDim = 12;

Message request_batch(std::int32_t size) {
  protocol::RolloutBatch batch;
  batch.learner_id = 77;
  batch.sequence = 1;
  for (std::int32_t i = 0; i < size; ++i) {
    batch.rollouts.push_back({.worker_id = 5,
                              .key = {.run = i, .number = 3},
                              .content = 1000 + i,
                              .task_id = content_hash("a task"),
                              .policy_id = content_hash("a policy"),
                              .theta = std::vector<double>(kThetaDim, .25 * i)});
  }
  return batch;
}

Message result_batch(std::int32_t size) {
  protocol::RewardBatch batch;
  batch.worker_id = 5;
  batch.learner_id = 77;
  batch.last_batch = 1;
  batch.first_index = 1;
  for (std::int32_t i = 0; i < size; ++i) {
    batch.results.push_back({.key = {.run = i, .number = 3},
                             .content = 1000 + i,
                             .outcome = Outcome::ok(.5),
                             .duration_ns = 1'000'000});
  }
  return batch;
}

/// Bytes of a message and of each roll-out in it; time is that of the whole message.
void count_bytes(benchmark::State& state, std::size_t bytes) {
  const auto size = static_cast<double>(state.range(0));
  state.counters["bytes_a_message"] = static_cast<double>(bytes);
  state.counters["bytes_a_rollout"] = static_cast<double>(bytes) / size;
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void encode(benchmark::State& state, Message (*make)(std::int32_t)) {
  const Message message = make(static_cast<std::int32_t>(state.range(0)));
  std::size_t bytes = 0;
  for (auto _ : state) {
    const std::vector<std::byte> encoded = transport::encode(message);
    bytes = encoded.size();
    benchmark::DoNotOptimize(encoded.data());
  }
  count_bytes(state, bytes);
}

void decode(benchmark::State& state, Message (*make)(std::int32_t)) {
  const Message message = make(static_cast<std::int32_t>(state.range(0)));
  const Channel channel = transport::channel_of(message);
  const std::vector<std::byte> encoded = transport::encode(message);
  CHECK(transport::decode(channel, encoded), "a message that decodes");
  for (auto _ : state) benchmark::DoNotOptimize(transport::decode(channel, encoded));
  count_bytes(state, encoded.size());
}

#define TREEROLL_CODEC_BENCHMARK(deed, batch) \
  BENCHMARK_CAPTURE(deed, batch, batch)->Name("codec/" #deed "/" #batch)->Arg(1)->Arg(16)->Arg(64)

TREEROLL_CODEC_BENCHMARK(encode, request_batch);
TREEROLL_CODEC_BENCHMARK(decode, request_batch);
TREEROLL_CODEC_BENCHMARK(encode, result_batch);
TREEROLL_CODEC_BENCHMARK(decode, result_batch);

}  // namespace
}  // namespace treeroll::benchmarks
