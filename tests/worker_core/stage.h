#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/content_hash.h"
#include "common/protocol/pieces.h"
#include "common/protocol/wire_sizes.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {

using namespace std::chrono_literals;

inline constexpr protocol::WorkerId kMe = 77;
inline constexpr protocol::LearnerId kLearner = 1;
inline const std::string kTask = R"({"name":"t","settings":{}})";
inline const std::string kPolicy = "a policy";

inline WorkerSettings stage_settings(int num_evaluators) {
  WorkerSettings settings;
  settings.worker_id = kMe;
  settings.num_evaluators = num_evaluators;
  settings.together_max = 1;
  return settings;
}

inline DefinitionName task_name(std::string_view content = kTask) {
  return {DefinitionKind::kTask, content_hash(content)};
}
inline DefinitionName policy_name(std::string_view content = kPolicy) {
  return {DefinitionKind::kPolicy, content_hash(content)};
}
/// A definition that is one piece.
inline MessageReceived task(std::string_view content, protocol::LearnerId learner = kLearner) {
  return {protocol::definition_piece(learner, task_name(content), content, 0)};
}
inline MessageReceived policy(std::string_view content, protocol::LearnerId learner = kLearner) {
  return {protocol::definition_piece(learner, policy_name(content), content, 0)};
}

/// What a batch takes on the wire.
inline std::size_t bytes_of(const protocol::RewardBatch& batch) {
  std::size_t bytes = protocol::kFrameBytesMax + protocol::kRewardBatchBytes;
  for (const protocol::RolloutResult& result : batch.results) {
    bytes += protocol::rollout_result_bytes(result.outcome.reason().size());
  }
  return bytes;
}

/// A worker core on virtual time, with evaluators that start and load at once but evaluate only
/// when told. Every effect since the last clear() is at hand.
class Stage {
 public:
  explicit Stage(int num_evaluators = 1, std::function<void(WorkerSettings&)> change = {})
      : core_(settings_with(num_evaluators, change)) {
    step(Started{});
  }

  /// One event, then what obedient evaluators answer at once, then the drained inbox.
  void step(const Event& event) {
    give(event);
    give(InboxDrained{});
  }

  /// One event and the obedient evaluators' answers: the inbox is not drained yet.
  void give(const Event& event) {
    Effects effects;
    core_.step(now, event, effects);
    for (const Effect& effect : effects) {
      effects_.push_back(effect);
      obey(effect);
    }
  }

  /// Time passes while the learner, which has nothing to ask, says once a second that it is there.
  void pass_heard(Duration duration) {
    const TimePoint end = now + duration;
    while (now < end) {
      pass(std::min<Duration>(std::chrono::seconds(1), end - now));
      protocol::LearnerStatus status;
      status.learner_id = kLearner;
      step(MessageReceived{status});
    }
  }
  /// Fires timers until `duration` has passed.
  void pass(Duration duration) {
    const TimePoint end = now + duration;
    while (core_.next_deadline() <= end) {
      now = std::max(now, core_.next_deadline());
      step(TimerFired{});
      ASSERT_GT(core_.next_deadline(), now) << "a deadline that does not move on";
    }
    now = end;
  }

  void define(protocol::LearnerId learner = kLearner) {
    step(task(kTask, learner));
    step(policy(kPolicy, learner));
  }

  protocol::RolloutRequest request(int number, int attempt = 0, std::int64_t content = 5) {
    return {.worker_id = kMe,
            .key = {.run = 0, .number = number},
            .attempt = attempt,
            .content = content,
            .task_id = content_hash(kTask),
            .policy_id = content_hash(kPolicy),
            .theta = {1, 2}};
  }

  void ask(std::vector<protocol::RolloutRequest> rollouts, protocol::LearnerId learner = kLearner) {
    step(MessageReceived{protocol::RolloutBatch{learner, ++sequence, std::move(rollouts), {}}});
  }

  /// Roll-outs from `first` on, in one batch.
  void ask_for(int count, int first = 0) {
    std::vector<protocol::RolloutRequest> requests;
    for (int i = 0; i < count; ++i) requests.push_back(request(first + i));
    ask(std::move(requests));
  }

  void acknowledge(std::int64_t index, protocol::LearnerId learner = kLearner) {
    step(MessageReceived{protocol::RolloutBatch{learner, ++sequence, {}, {{kMe, index, index}}}});
  }
  /// The learner has read all up to here, and they are not on stable storage yet.
  void see(std::int64_t index, protocol::LearnerId learner = kLearner) {
    step(MessageReceived{protocol::RolloutBatch{learner, ++sequence, {}, {{kMe, index, 0}}}});
  }

  /// The evaluator finishes what it runs.
  void finish(int evaluator, double reward = .5, RolloutStatus status = RolloutStatus::kOk) {
    step(RolloutEvaluated{evaluator, job(evaluator), {reward, status}, 1000});
  }

  /// So much time passes, and the first evaluator finishes what took it.
  void work(Duration duration) {
    pass(duration);
    step(RolloutEvaluated{0, job(0), Outcome::ok(.5), duration.count()});
  }

  void die(int evaluator, Death death, int code = 9) {
    step(EvaluatorDied{evaluator, death, code});
  }

  /// Number of the last roll-out the evaluator was given.
  std::int64_t job(int evaluator) const {
    const RunRollouts& last = jobs_.at(static_cast<std::size_t>(evaluator));
    return last.job + std::ssize(last.requests) - 1;
  }
  const protocol::RolloutRequest& running(int evaluator) const {
    return jobs_.at(static_cast<std::size_t>(evaluator)).requests.back();
  }

  /// What evaluators were given since the last clear(), one by one.
  struct Run {
    int evaluator = 0;
    std::int64_t job = 0;
    protocol::RolloutRequest request;
  };
  std::vector<Run> runs() const {
    std::vector<Run> runs;
    for (const RunRollouts& packet : effects<RunRollouts>()) {
      std::int64_t job = packet.job;
      for (const auto& request : packet.requests)
        runs.push_back({packet.evaluator, job++, request});
    }
    return runs;
  }

  template <class T>
  std::vector<T> effects() const {
    std::vector<T> found;
    for (const Effect& effect : effects_) {
      if (const T* one = std::get_if<T>(&effect)) found.push_back(*one);
    }
    return found;
  }
  template <class T>
  std::vector<T> sent() const {
    std::vector<T> found;
    for (const SendMessage& send : effects<SendMessage>()) {
      if (const T* one = std::get_if<T>(&send.message)) found.push_back(*one);
    }
    return found;
  }
  const Effects& all_effects() const { return effects_; }
  void clear() { effects_.clear(); }

  /// The latest heartbeat, one made to come if need be.
  protocol::WorkerStatus status() {
    pass(250ms);
    return sent<protocol::WorkerStatus>().back();
  }

  TimePoint now = TimePoint(1h);
  std::int64_t sequence = 0;
  bool evaluators_start = true;
  bool definitions_load = true;
  std::string refusal;  ///< not empty: evaluators refuse definitions for this reason
  DefinitionFacts task_facts{.input_dim = 1, .output_dim = 1, .time_limit = 2s};
  DefinitionFacts policy_facts{.input_dim = 1, .output_dim = 1, .theta_dim = 2};
  /// What an evaluator has burnt on its job when asked.
  Duration cpu_time{};

 private:
  static WorkerSettings settings_with(int num_evaluators,
                                      const std::function<void(WorkerSettings&)>& change) {
    WorkerSettings settings = stage_settings(num_evaluators);
    if (change) change(settings);
    return settings;
  }

  void obey(const Effect& effect) {
    if (const auto* start = std::get_if<StartEvaluator>(&effect); start && evaluators_start) {
      give(EvaluatorReady{start->evaluator});
    } else if (const auto* load = std::get_if<LoadDefinition>(&effect); load && definitions_load) {
      const bool is_task = load->name.kind == DefinitionKind::kTask;
      give(DefinitionLoaded{load->evaluator, load->name, refusal.empty(),
                            refusal.empty() ? "described" : refusal,
                            is_task ? task_facts : policy_facts});
    } else if (const auto* run = std::get_if<RunRollouts>(&effect)) {
      jobs_.resize(std::max(jobs_.size(), static_cast<std::size_t>(run->evaluator) + 1));
      jobs_[static_cast<std::size_t>(run->evaluator)] = *run;
    } else if (const auto* look = std::get_if<AskCpuTime>(&effect)) {
      give(CpuTimeMeasured{look->evaluator, look->job, cpu_time});
    }
  }

  WorkerCore core_;
  Effects effects_;
  std::vector<RunRollouts> jobs_;
};

}  // namespace treeroll::worker
