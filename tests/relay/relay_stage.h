#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/protocol/pieces.h"
#include "tests/learner_core/fake_worker.h"
#include "workers/relay/relay_core.h"

namespace treeroll::relay {

using namespace std::chrono_literals;

inline constexpr protocol::WorkerId kRelay = 500;
inline constexpr protocol::LearnerId kLearner = 1;
inline const std::string kTask = R"({"name":"bump","settings":{}})";
inline const std::string kPolicy = "a policy";

/// A relay core in virtual time: fake workers below, a learner above whose words a test says.
class RelayStage {
 public:
  explicit RelayStage(const std::string& numeric_class = "") : core_(settings(numeric_class)) {
    step(Started{});
  }

  learner::FakeWorker& add_worker(protocol::WorkerId id, Duration duration = 10ms) {
    workers_.push_back(std::make_unique<Place>(learner::FakeWorker(id, duration)));
    return workers_.back()->worker;
  }
  /// Nothing that is sent reaches it.
  learner::FakeWorker& add_deaf_worker(protocol::WorkerId id) {
    learner::FakeWorker& worker = add_worker(id);
    workers_.back()->is_deaf = true;
    return worker;
  }
  learner::FakeWorker& worker(std::size_t place) { return workers_.at(place)->worker; }
  /// As it has heard last, below.
  protocol::LearnerId learner_of(std::size_t place) const { return workers_.at(place)->learner; }
  /// What is sent does not reach the workers; what they say is heard.
  bool below_is_deaf = false;
  void remove_worker(std::size_t place) {
    workers_.erase(workers_.begin() + static_cast<std::ptrdiff_t>(place));
  }

  void say(const protocol::Message& message) {
    step(MessageFromAbove{message});
    step(InboxDrained{});
  }
  void drain() {
    step(DrainRequested{});
    step(InboxDrained{});
  }
  /// Definitions as a learner sends them at its start.
  void define(protocol::LearnerId learner = kLearner) {
    say(protocol::definition_piece(learner, {protocol::DefinitionKind::kTask, content_hash(kTask)},
                                   kTask, 0));
    say(protocol::definition_piece(
        learner, {protocol::DefinitionKind::kPolicy, content_hash(kPolicy)}, kPolicy, 0));
  }
  /// Roll-outs with these numbers.
  void ask(const std::vector<int>& numbers, protocol::LearnerId learner = kLearner) {
    protocol::RolloutBatch batch{learner, ++sequence_[learner], {}, {}};
    for (const int number : numbers) {
      batch.rollouts.push_back({.worker_id = kRelay,
                                .key = {.run = 0, .number = number},
                                .attempt = 0,
                                .content = 100 + number,
                                .task_id = content_hash(kTask),
                                .policy_id = content_hash(kPolicy),
                                .theta = {.1 * number, 0}});
    }
    say(batch);
  }

  /// All answers up to this one are on the learner's disk.
  void acknowledge(std::int64_t index, protocol::LearnerId learner = kLearner) {
    say(protocol::RolloutBatch{learner, ++sequence_[learner], {}, {{kRelay, index, index}}});
  }

  /// Time passes: timers, heartbeats of workers each 100 ms, roll-outs that end. The learner says
  /// once a second that it is there.
  void pass(Duration duration) {
    const TimePoint end = now + duration;
    while (true) {
      TimePoint next = std::min(core_.next_deadline(), heartbeat_at_);
      if (learner_speaks) next = std::min(next, status_at_);
      for (const auto& place : workers_) {
        if (place->worker.has_work()) next = std::min(next, place->worker.busy_until());
      }
      if (next > end) break;
      now = std::max(now, next);
      if (now >= core_.next_deadline()) step(TimerFired{});
      if (learner_speaks && now >= status_at_) {
        status_at_ = now + 1s;
        protocol::LearnerStatus status;
        status.learner_id = kLearner;
        status.study = "study";
        status.num_workers = 1;
        say(status);
      }
      if (now >= heartbeat_at_) {
        heartbeat_at_ = now + 100ms;
        for (const auto& place : workers_) hear(place->worker.status(place->learner));
      }
      for (const auto& place : workers_) {
        if (place->worker.has_work() && now >= place->worker.busy_until()) {
          hear(place->worker.finish(place->learner, now));
        }
      }
    }
    now = end;
  }

  void hear(const protocol::Message& message) {
    step(MessageFromBelow{message});
    step(InboxDrained{});
  }

  template <class T>
  std::vector<T> above() const {
    return of_type<T>(above_);
  }
  template <class T>
  std::vector<T> below() const {
    return of_type<T>(below_);
  }
  /// All results that have gone up, each once.
  std::map<int, protocol::RolloutResult> results() const {
    std::map<int, protocol::RolloutResult> all;
    for (const auto& batch : above<protocol::RewardBatch>()) {
      for (const auto& result : batch.results) all.emplace(result.key.number, result);
    }
    return all;
  }
  bool logs(const std::string& words) const {
    return std::any_of(log_.begin(), log_.end(), [&](const LogLine& line) {
      return line.text.find(words) != std::string::npos;
    });
  }
  void clear() {
    above_.clear();
    below_.clear();
    log_.clear();
  }

  TimePoint now = TimePoint(1h);
  bool learner_speaks = true;
  std::vector<int> exits;
  Duration spent{};  ///< in the core

 private:
  struct Place {
    explicit Place(learner::FakeWorker w) : worker(std::move(w)) {}
    learner::FakeWorker worker;
    protocol::LearnerId learner = 0;  ///< below, that it has heard last
    bool is_deaf = false;
  };

  static RelaySettings settings(const std::string& numeric_class) {
    RelaySettings settings;
    settings.relay_id = kRelay;
    settings.host = "rack";
    settings.numeric_class = numeric_class;
    return settings;
  }

  template <class T>
  static std::vector<T> of_type(const std::vector<protocol::Message>& messages) {
    std::vector<T> found;
    for (const protocol::Message& message : messages) {
      if (const T* one = std::get_if<T>(&message)) found.push_back(*one);
    }
    return found;
  }

  void step(const Event& event) {
    Effects effects;
    const auto start = std::chrono::steady_clock::now();
    core_.step(now, event, effects);
    spent += std::chrono::steady_clock::now() - start;
    std::vector<protocol::Message> replies;
    for (const Effect& effect : effects) {
      if (const auto* send = std::get_if<SendAbove>(&effect)) above_.push_back(send->message);
      if (const auto* line = std::get_if<LogLine>(&effect)) log_.push_back(*line);
      if (const auto* exit = std::get_if<Exit>(&effect)) exits.push_back(exit->status);
      const auto* send = std::get_if<SendBelow>(&effect);
      if (send == nullptr) continue;
      below_.push_back(send->message);
      if (below_is_deaf) continue;
      for (const auto& place : workers_) {
        if (place->is_deaf) continue;
        if (const auto* batch = std::get_if<protocol::RolloutBatch>(&send->message)) {
          place->learner = batch->learner_id;
        }
        for (auto& reply : place->worker.receive(send->message, now)) {
          replies.push_back(std::move(reply));
        }
      }
    }
    for (const protocol::Message& reply : replies) hear(reply);
  }

  RelayCore core_;
  std::vector<std::unique_ptr<Place>> workers_;
  std::map<protocol::LearnerId, std::int64_t> sequence_;
  TimePoint heartbeat_at_ = TimePoint(1h);
  TimePoint status_at_ = TimePoint(1h);
  std::vector<protocol::Message> above_;
  std::vector<protocol::Message> below_;
  std::vector<LogLine> log_;
};

}  // namespace treeroll::relay
