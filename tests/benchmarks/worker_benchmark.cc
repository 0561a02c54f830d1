#include <benchmark/benchmark.h>

#include <string>
#include <string_view>
#include <vector>

#include "common/base/check.h"
#include "common/base/content_hash.h"
#include "common/protocol/pieces.h"
#include "common/transport/codec.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

constexpr protocol::LearnerId kAsker = 1;
constexpr protocol::WorkerId kMe = 77;
constexpr int kNumEvaluators = 2;
constexpr std::size_t kThetaAsked = 12;
constexpr std::string_view kTask = R"({"name":"t","settings":{}})";

/// A worker core between a learner that asks for so many roll-outs a message and acknowledges all
/// it gets, and evaluators that answer at once.
class WorkerLoop {
 public:
  /// @param num_policies  that roll-outs have in turn
  explicit WorkerLoop(int num_policies) : core_(settings()) {
    step(Started{});
    define({DefinitionKind::kTask, task_id_}, kTask);
    for (int i = 0; i < num_policies; ++i) {
      const std::string policy = "policy " + std::to_string(i);
      policy_ids_.push_back(content_hash(policy));
      define({DefinitionKind::kPolicy, policy_ids_.back()}, policy);
    }
    step(InboxDrained{});
  }

  /// One message of requests, read, evaluated and answered.
  void serve(std::int32_t num_rollouts) {
    const std::vector<std::byte> request = transport::encode(next_batch(num_rollouts));
    const std::int64_t end = num_results_ + num_rollouts;
    begin_turn();
    auto message = transport::decode(transport::Channel::kRolloutBatch, request);
    step(MessageReceived{std::move(*message)});
    drain();
    for (int turns = 0; num_results_ < end; ++turns) {
      CHECK(turns < 10'000, "the worker answers what it was asked");
      begin_turn();
      if (core_.next_deadline() <= now_) step(TimerFired{});
      drain();
    }
  }

  std::int64_t num_messages() const { return num_messages_; }

 private:
  void define(const DefinitionName& name, std::string_view content) {
    step(MessageReceived{protocol::definition_piece(kAsker, name, content, 0)});
  }

  static WorkerSettings settings() {
    WorkerSettings settings;
    settings.worker_id = kMe;
    settings.num_evaluators = kNumEvaluators;
    return settings;
  }

  protocol::RolloutBatch next_batch(std::int32_t num_rollouts) {
    protocol::RolloutBatch batch{
        .learner_id = kAsker,
        .sequence = ++sequence_,
        .rollouts = {},
        .acknowledgements = {
            {.worker_id = kMe, .seen_index = num_results_, .result_index = num_results_}}};
    for (std::int32_t run = 0; run < num_rollouts; ++run) {
      batch.rollouts.push_back(
          {.worker_id = kMe,
           .key = {.run = run, .number = static_cast<std::int32_t>(sequence_)},
           .content = sequence_ * 1000 + run,
           .task_id = task_id_,
           .policy_id = policy_ids_[static_cast<std::size_t>(run) % policy_ids_.size()],
           .theta = std::vector<double>(kThetaAsked, .25)});
    }
    return batch;
  }

  void begin_turn() { now_ += std::chrono::milliseconds(1); }

  /// What evaluators answer comes in the turns that follow, until all are idle.
  void drain() {
    while (!running_.empty()) {
      for (const RunRollouts& run : std::exchange(running_, {})) {
        for (std::int64_t i = 0; i < std::ssize(run.requests); ++i) {
          step(EvaluatorEvent{RolloutEvaluated{run.evaluator, run.job + i, Outcome::ok(.5), 1000}});
        }
      }
    }
    step(InboxDrained{});
  }

  void step(const Event& event) {
    Effects effects;
    core_.step(now_, event, effects);
    for (const Effect& effect : effects) obey(effect);
  }

  void obey(const Effect& effect) {
    if (const auto* start = std::get_if<StartEvaluator>(&effect)) {
      step(EvaluatorEvent{EvaluatorReady{start->evaluator}});
    } else if (const auto* load = std::get_if<LoadDefinition>(&effect)) {
      step(EvaluatorEvent{DefinitionLoaded{
          load->evaluator,
          load->name,
          true,
          "described",
          {.input_dim = 1,
           .output_dim = 1,
           .theta_dim = load->name.kind == DefinitionKind::kPolicy ? int{kThetaAsked} : 0,
           .time_limit = std::chrono::seconds(2)}}});
    } else if (const auto* run = std::get_if<RunRollouts>(&effect)) {
      running_.push_back(*run);
    } else if (const auto* send = std::get_if<SendMessage>(&effect)) {
      benchmark::DoNotOptimize(transport::encode(send->message));
      ++num_messages_;
      if (const auto* batch = std::get_if<protocol::RewardBatch>(&send->message)) {
        // Nothing is lost and all is acknowledged: a result that came twice would cost twice.
        CHECK(batch->results.empty() || batch->first_index == num_results_ + 1,
              "each result is sent once");
        num_results_ += static_cast<std::int64_t>(batch->results.size());
      }
    }
  }

  WorkerCore core_;
  TimePoint now_{std::chrono::hours(1)};
  ContentHash task_id_ = content_hash(kTask);
  std::vector<ContentHash> policy_ids_;
  std::vector<RunRollouts> running_;
  std::int64_t sequence_ = 0;
  std::int64_t num_results_ = 0;
  std::int64_t num_messages_ = 0;
};

/// Requests decoded, queued, given to evaluators, answered and encoded: the daemon's part without
/// its sockets. Arguments: roll-outs a message; policies they have, as many as runs after a switch.
void rollouts(benchmark::State& state) {
  const auto size = static_cast<std::int32_t>(state.range(0));
  WorkerLoop loop(static_cast<int>(state.range(1)));
  loop.serve(size);
  const std::int64_t before = loop.num_messages();
  for (auto _ : state) loop.serve(size);
  state.SetItemsProcessed(state.iterations() * size);
  state.counters["messages_sent_a_result"] = static_cast<double>(loop.num_messages() - before) /
                                             static_cast<double>(state.iterations() * size);
}
BENCHMARK(rollouts)
    ->Name("worker/rollouts")
    ->ArgNames({"a_message", "policies"})
    ->ArgsProduct({{1, 16, 64}, {1}})
    ->Args({64, 64})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace treeroll::worker
