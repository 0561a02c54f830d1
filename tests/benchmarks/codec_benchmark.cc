#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "common/base/check.h"
#include "common/base/content_hash.h"
#include "common/transport/authenticator.h"
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

/// A learner and a worker of its that have met: each knows the other's key.
struct Signers {
  transport::Authenticator learner{ring(transport::line_of(transport::Key{}))};
  transport::Authenticator worker{ring(line_of(transport::worker_key({}, 1)))};

  static transport::KeyRing ring(const std::string& line) {
    return *transport::KeyRing::parse(line);
  }
  Signers() {
    protocol::WorkerStatus status;
    status.worker_id = 5;
    std::vector<std::byte> bytes = transport::encode(status);
    worker.sign(status, bytes);
    CHECK(!learner.refusal(Channel::kWorkerStatus, bytes), "a status that is signed");
    // Its name is known from now on.
    const Message batch = request_batch(1);
    bytes = transport::encode(batch);
    learner.sign(batch, bytes);
  }
};

/// An answer of 150 bytes or so where there is one result: the copy that is signed is counted too.
void sign(benchmark::State& state, Message (*make)(std::int32_t)) {
  Signers signers;
  const Message message = make(static_cast<std::int32_t>(state.range(0)));
  const bool is_learners = std::holds_alternative<protocol::RolloutBatch>(message);
  const std::vector<std::byte> plain = transport::encode(message);
  std::vector<std::byte> bytes;
  for (auto _ : state) {
    bytes = plain;
    (is_learners ? signers.learner : signers.worker).sign(message, bytes);
    benchmark::DoNotOptimize(bytes.data());
  }
  count_bytes(state, bytes.size());
}

void check(benchmark::State& state, Message (*make)(std::int32_t)) {
  Signers signers;
  const Message message = make(static_cast<std::int32_t>(state.range(0)));
  const bool is_learners = std::holds_alternative<protocol::RolloutBatch>(message);
  std::vector<std::byte> bytes = transport::encode(message);
  (is_learners ? signers.learner : signers.worker).sign(message, bytes);
  transport::Authenticator& reader = is_learners ? signers.worker : signers.learner;
  const Channel channel = transport::channel_of(message);
  CHECK(!reader.refusal(channel, bytes), "a message that is signed");
  CHECK(reader.admit(message, bytes) == transport::Authenticator::Admission::kTaken,
        "a message that is new");
  for (auto _ : state) {
    benchmark::DoNotOptimize(reader.refusal(channel, bytes));
    benchmark::DoNotOptimize(reader.admit(message, bytes));
  }
  count_bytes(state, bytes.size());
}

#define TREEROLL_CODEC_BENCHMARK(deed, batch) \
  BENCHMARK_CAPTURE(deed, batch, batch)->Name("codec/" #deed "/" #batch)->Arg(1)->Arg(16)->Arg(64)

TREEROLL_CODEC_BENCHMARK(encode, request_batch);
TREEROLL_CODEC_BENCHMARK(decode, request_batch);
TREEROLL_CODEC_BENCHMARK(encode, result_batch);
TREEROLL_CODEC_BENCHMARK(decode, result_batch);
TREEROLL_CODEC_BENCHMARK(sign, request_batch);
TREEROLL_CODEC_BENCHMARK(check, request_batch);
TREEROLL_CODEC_BENCHMARK(sign, result_batch);
TREEROLL_CODEC_BENCHMARK(check, result_batch);

}  // namespace
}  // namespace treeroll::benchmarks
