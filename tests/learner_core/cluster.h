#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/numbers/random_stream.h"
#include "common/policy/tree/tree_policy.h"
#include "tests/learner_core/effects.h"
#include "tests/learner_core/fake_worker.h"

namespace treeroll::learner {

/// A flat policy of two components, means explored: theta has 4 elements.
inline PolicyPtr small_policy(double offset = 0) {
  std::vector<Component> components;
  for (const double t : {0., 1.}) {
    Component component;
    component.prior = .5;
    component.mean = Eigen::Vector2d(t, offset);
    component.covariance = Eigen::Matrix2d::Identity() * .1;
    components.push_back(component);
  }
  return std::make_shared<TreePolicy>(
      TreeModel::from_global(FrameKind::kEigenvector, {Gmm(1, components)}, {{}}), 1,
      ThetaLayout::kMeans);
}

/// A tree of two layers, the first of one component, the second of two.
inline PolicyPtr two_layers() {
  const auto component = [](double prior, double at) {
    Component made;
    made.prior = prior;
    made.mean = Eigen::Vector2d(at, 0);
    made.covariance = Eigen::Matrix2d::Identity() * .1;
    return made;
  };
  return std::make_shared<TreePolicy>(
      TreeModel::from_global(
          FrameKind::kEigenvector,
          {Gmm(1, {component(1, .5)}), Gmm(1, {component(.5, 0), component(.5, 1)})}, {{}, {0, 0}}),
      1, ThetaLayout::kMeans);
}

inline Study small_study(int num_rollouts, int repetitions, int in_flight = 1) {
  Condition condition{"flat", R"({"name":"bump","settings":{}})", small_policy(),
                      explore::ExplorationSettings{}};
  condition.exploration.num_rollouts = num_rollouts;
  condition.exploration.in_flight = in_flight;
  condition.exploration.rule = explore::PowerSettings{.first_update = 5, .best_considered = 3};
  condition.exploration.noise_variance = {.02, .02};
  Study study;
  study.name = "small";
  study.seed = 5;
  study.repetitions = repetitions;
  study.conditions = {condition};
  return study;
}

/// The learner core and fake workers in virtual time: events in order of their time, messages with
/// a delay, some lost.
class Cluster {
 public:
  explicit Cluster(Study study, bool knows_task = true, bool repeatable = true,
                   bool is_authenticated = false) {
    LearnerSettings settings;
    settings.is_authenticated = is_authenticated;
    settings.learner_id = kLearner;
    settings.batch_bytes_max = 60000;
    settings.host = "here";
    settings.pid = 4321;
    if (knows_task) {
      settings.known_tasks[study.conditions[0].task_content] =
          TaskDescription{1, 1, 0, 1, 10, true, repeatable};
      description = to_json(settings.known_tasks.begin()->second).dump();
    }
    core = std::make_unique<LearnerCore>(std::move(study), settings);
  }

  static constexpr protocol::LearnerId kLearner = 77;

  FakeWorker& add_worker(protocol::WorkerId id, Duration duration = std::chrono::milliseconds(10)) {
    workers.emplace_back(std::make_unique<FakeWorker>(id, duration));
    workers.back()->description = description;
    next_heartbeat.push_back(now);
    return *workers.back();
  }
  void remove_worker(std::size_t place) {
    workers.erase(workers.begin() + static_cast<std::ptrdiff_t>(place));
    next_heartbeat.erase(next_heartbeat.begin() + static_cast<std::ptrdiff_t>(place));
  }

  /// Neither is anything heard of it for so long, nor does it hear.
  void silence(protocol::WorkerId id, Duration lasts) { silent_until_[id] = now + lasts; }

  void start() { step(Started{}); }
  /// @param times  by how many results stand before
  void recover(const std::vector<AcceptedResult>& results,
               const std::map<std::size_t, LearningTime>& times = {}) {
    for (std::size_t place = 0; place <= results.size(); ++place) {
      const auto time = times.find(place);
      if (time != times.end()) step(TimeRecovered{time->second});
      if (place < results.size()) step(ResultRecovered{results[place]});
    }
  }
  void tell(const Event& event) { step(event); }
  void stop() { step(StopRequested{}); }

  /// Runs until the study is done or `limit` of virtual time has passed; `each` after every event.
  void run(
      Duration limit, const std::function<void()>& each = [] {}) {
    const TimePoint end = now + limit;
    if (std::exchange(recovers_, false)) step(RecoveryFinished{});
    while (core->outcome() == LearnerCore::Outcome::kRunning && advance(end)) each();
  }

  /// More is on its way: the learner does not answer yet.
  void hear(const protocol::Message& message) { step(MessageReceived{message}); }
  void give(const protocol::Message& message) {
    hear(message);
    step(InboxDrained{});
  }

  std::unique_ptr<LearnerCore> core;
  std::vector<std::unique_ptr<FakeWorker>> workers;
  TimePoint now{};
  double loss = 0;                         ///< of each message to each receiver
  Duration timer_delay{0};                 ///< a busy learner's timers fire so late
  std::string description = kDescription;  ///< by the workers, of every task
  std::vector<LogLine> log;
  std::vector<KnownWorker> notes;
  std::vector<std::pair<std::size_t, TaskSignals>> signals;  ///< and how many results stand before
  std::vector<protocol::Message> sent;                       ///< by the learner
  std::vector<AcceptedResult> journal;
  std::vector<SecondAnswer> second_answers;
  std::map<std::size_t, LearningTime> times;  ///< by how many results the journal held by then

 private:
  /// To the next event: the learner's deadline, a heartbeat or the end of an evaluation. False,
  /// and nothing happens, if that is after `end`.
  bool advance(TimePoint end) {
    TimePoint next = core->next_deadline() + timer_delay;
    std::size_t who = workers.size();
    bool heartbeat = false;
    for (std::size_t i = 0; i < workers.size(); ++i) {
      if (workers[i]->has_work() && workers[i]->busy_until() < next) {
        next = workers[i]->busy_until();
        who = i;
        heartbeat = false;
      }
      if (next_heartbeat[i] < next) {
        next = next_heartbeat[i];
        who = i;
        heartbeat = true;
      }
    }
    if (next > end) {
      now = end;
      return false;
    }
    now = std::max(now, next);
    if (who == workers.size()) {
      step(TimerFired{});
    } else if (heartbeat) {
      next_heartbeat[who] = now + std::chrono::milliseconds(100);
      if (!is_silent(*workers[who])) to_learner(workers[who]->status(kLearner));
    } else {
      const protocol::Message batch = workers[who]->finish(kLearner, now);
      if (!is_silent(*workers[who])) to_learner(batch);
    }
    return true;
  }

  bool is_silent(const FakeWorker& worker) const {
    const auto until = silent_until_.find(worker.id());
    return until != silent_until_.end() && now < until->second;
  }
  bool arrives() { return loss == 0 || fate_.next_uniform() >= loss; }

  void to_learner(const protocol::Message& message) {
    if (arrives()) give(message);
  }

  void step(const Event& event) {
    Effects effects;
    core->step(now, event, effects);
    const std::vector<AcceptedResult> results = results_in(effects);
    journal.insert(journal.end(), results.begin(), results.end());
    const bool has_second = std::ranges::any_of(
        effects, [](const Effect& effect) { return std::holds_alternative<AppendSecond>(effect); });
    if (!results.empty() || has_second) {
      core->step(now, SyncBegun{}, effects);
      core->step(now, JournalSynced{}, effects);
    }
    for (const Effect& effect : effects) {
      if (const auto* time = std::get_if<AppendTime>(&effect)) times[journal.size()] = time->time;
      if (const auto* second = std::get_if<AppendSecond>(&effect)) {
        second_answers.push_back(second->answer);
      }
      if (const auto* line = std::get_if<LogLine>(&effect)) log.push_back(*line);
      if (const auto* note = std::get_if<AppendWorker>(&effect)) notes.push_back(note->worker);
      const auto* names = std::get_if<AppendSignals>(&effect);
      if (names) signals.emplace_back(journal.size() - results.size(), names->signals);
    }
    for (const protocol::Message& message : messages_in(effects)) {
      sent.push_back(message);
      for (const auto& worker : workers) {
        if (!arrives() || is_silent(*worker)) continue;
        for (const protocol::Message& reply : worker->receive(message, now))
          replies_.push_back(reply);
      }
    }
    while (!replies_.empty()) {
      const protocol::Message reply = replies_.back();
      replies_.pop_back();
      to_learner(reply);
    }
  }

  bool recovers_ = true;
  std::vector<TimePoint> next_heartbeat;
  std::map<protocol::WorkerId, TimePoint> silent_until_;
  std::vector<protocol::Message> replies_;
  RandomStream fate_{99, 0, 0, RandomPurpose::kPerturbation};
};

}  // namespace treeroll::learner
