#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "learner/core/learner_events.h"
#include "workers/core/evaluators.h"
#include "workers/relay/downlink.h"

namespace treeroll::relay {

struct RackSettings {
  protocol::WorkerId relay_id = 0;  ///< ids below follow from it
  std::size_t batch_bytes_max = 0;  ///< below
  std::size_t word_bytes = 0;       ///< below: what a batch takes more for each worker it names
  std::size_t num_learners_max = protocol::kLearnersPerWorkerMax;
  Duration learner_silence_max = protocol::kLearnerSilenceMax;
};

/// All workers below, as the evaluators of one worker: a Downlink for each learner. What it is
/// given goes down at once, since the workers have queues of their own. What comes of it is taken
/// up by on(EvaluatorDied{}), which its owner gives the core above whenever has_news().
class Rack : public worker::Evaluators {
 public:
  explicit Rack(RackSettings settings) : settings_(settings) {}

  // For the core above.

  void start(const worker::Turn&) override {}
  void drain() override;
  int count() const override { return count_; }
  std::optional<int> idle_evaluator() const override;
  void check(const worker::Turn& turn, int index, const worker::DefinitionName& name,
             const worker::DefinitionShelf& definitions) override;
  void evaluate(const worker::Turn& turn, int index, std::vector<worker::Work> works,
                worker::DefinitionShelf& definitions) override;
  void withdraw(const worker::RolloutName& name) override;
  /// Its worker below ends it when the learner's silence has come down to it.
  bool end_work(const worker::Turn&, const worker::RolloutName& name) override {
    withdraw(name);
    return true;
  }
  std::vector<worker::WorkEnd> on(const worker::Turn& turn, const worker::EvaluatorEvent& event,
                                  worker::DefinitionShelf& definitions) override;
  void watch(const worker::Turn&) override {}
  TimePoint next_deadline() const override { return TimePoint::max(); }
  void excuse(Duration) override {}
  bool any_living() const override { return count_ > 0; }
  /// What waits for a word of its workers is given up too.
  bool in_trouble() const override { return count_ == 0; }
  std::int64_t num_restarts() const override { return 0; }

  // For the relay.

  /// Evaluators below from now on. Without any all work is given up.
  void set_count(int count);
  bool has_news() const { return looks_ || count_ != next_count_ || !news_.empty(); }
  void receive(TimePoint now, const protocol::Message& message);
  /// To the learner that has most of it; nothing while none is served.
  std::optional<Standing> standing_of(protocol::WorkerId worker, TimePoint now) const;
  /// A learner above says how it is: the workers below are told. Ignored unless it is served.
  void pass_on(TimePoint now, const protocol::LearnerStatus& status);
  /// It has been heard in any other way.
  void hear(TimePoint now, protocol::LearnerId learner);
  void on_timer(TimePoint now);
  /// Once a second or so: what is forgotten by then, and what is to be asked again.
  void remind(TimePoint now);
  void dispatch(TimePoint now);
  std::optional<TimePoint> downlink_deadline() const;

  /// What is to be sent below, and said. To be taken after each of these calls.
  learner::Effects take_effects() { return std::exchange(effects_, {}); }

 private:
  learner::Turn turn_at(TimePoint now) { return {now, effects_, log_limiter_}; }
  Downlink* serve(TimePoint now, protocol::LearnerId learner);
  bool make_room();
  Downlink* find(protocol::LearnerId learner);

  RackSettings settings_;
  std::map<protocol::LearnerId, Downlink> downlinks_;
  News news_;
  learner::Effects effects_;
  LogLimiter log_limiter_;
  int count_ = 0;
  int next_count_ = 0;  ///< from on() on, so that the core sees it change
  bool looks_ = false;  ///< refusals are to be forgotten
  bool draining_ = false;
  std::int64_t num_served_ = 0;  ///< learners, a returning one anew
  std::int64_t num_evicted_seen_ = 0;
  bool forgets_refusals_ = false;
  TimePoint refusals_end_;
};

}  // namespace treeroll::relay
