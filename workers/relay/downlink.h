#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "learner/core/workforce.h"
#include "workers/core/evaluators.h"

namespace treeroll::relay {

/// What of a learner's business has been settled below, for the worker core above.
struct News {
  std::vector<worker::WorkEnd> ends;
  std::vector<worker::DefinitionLoaded> verdicts;  ///< on tasks that were to be checked
  /// Definitions that no worker below takes, and the learner that is to be told.
  struct Refusal {
    protocol::LearnerId learner = 0;
    ContentHash definition;
    std::string reason;
  };
  std::vector<Refusal> refusals;

  bool empty() const { return ends.empty() && verdicts.empty() && refusals.empty(); }
};

/// What a learner has of a worker below.
struct Standing {
  enum class Use {
    kNone,
    kPerhaps,  ///< it has a greeting to answer, and may
    kNow,
  };
  Use use = Use::kNone;
  bool has_answered_a_greeting = false;
  std::int64_t num_accepted = 0;
};

/// One learner as the workers below see it: its roll-outs under their own keys, from a learner of
/// an id of its own, over a Workforce. It learns nothing and keeps no journal: what it has read of
/// an answer counts as settled below, for the relay keeps it until it is settled above.
class Downlink : private learner::Client {
 public:
  /// @param above     the learner that is served
  /// @param settings  its learner_id is the id below. `news` must outlive the link.
  Downlink(TimePoint now, protocol::LearnerId above, const learner::LearnerSettings& settings,
           News& news);

  /// The workers are to describe this task: a verdict or a refusal follows.
  void check_task(const learner::Turn& turn, const std::string& content);
  /// Precondition: the key is not open here.
  void ask(const learner::Turn& turn, const protocol::RolloutRequest& request,
           const std::string& task, const std::string& policy);
  /// Nobody waits for it any more. Nothing happens if it is not open.
  void withdraw(protocol::RolloutKey key);
  /// Its learner has gone: what was to be described is not, here.
  void leave();
  /// All that is open is given up.
  void give_up_all();
  /// From now on nothing is given out; what no worker has is put back.
  void drain();

  void hear_above(TimePoint now) { heard_above_ = now; }
  TimePoint heard_above() const { return heard_above_; }
  /// The status of the learner above, as it goes on to the workers below.
  protocol::LearnerStatus passed_on(TimePoint now, protocol::LearnerStatus status);
  void receive(const learner::Turn& turn, const protocol::Message& message);
  void look_after_leases(const learner::Turn& turn) { workforce_.look_after_leases(turn); }
  /// Once a second or so.
  void remind(const learner::Turn& turn);
  void dispatch(const learner::Turn& turn);
  std::optional<TimePoint> next_deadline() const { return workforce_.next_deadline(); }
  /// Policies that the shelf has evicted are given up here too.
  void keep_only(const worker::DefinitionShelf& definitions);

  std::size_t num_open() const { return open_.size(); }
  Standing standing_of(protocol::WorkerId worker, TimePoint now) const;

 private:
  struct Open {
    ContentHash task_id;
    ContentHash policy_id;
    worker::Mishaps mishaps;
  };
  struct Taken {
    ContentHash task_id;
    learner::Answer answer;
  };

  std::optional<ContentHash> task_of(protocol::RolloutKey key) const override;
  std::optional<learner::Answer> answer_of(protocol::RolloutKey key) const override;
  /// Who asks does it.
  bool is_rechecked(protocol::RolloutKey) const override { return false; }
  void take(const learner::Turn& turn, const AcceptedResult& result, int numeric_class) override;
  /// Workers below find out what does not go together.
  std::optional<std::string> fault_of(const ContentHash&, const TaskDescription&) const override {
    return std::nullopt;
  }
  std::optional<std::string> take_facts(const learner::Turn& turn, const ContentHash& task_id,
                                        const TaskDescription& facts) override;
  /// Its learner gets them with the description.
  void take_signals(const TaskSignals&) override {}
  void add_task(const learner::Turn& turn, const ContentHash& id, const std::string& content);
  void look_for_refusals();
  void refuse(const ContentHash& task, std::string reason);
  worker::RolloutName name(protocol::RolloutKey key) const { return {above_, key}; }

  const protocol::LearnerId above_;
  const protocol::LearnerId below_;
  News& news_;
  learner::Workforce workforce_;
  TimePoint introduced_;  ///< by then workers have heard of it and answered
  TimePoint heard_above_;
  bool has_met_workers_ = false;  ///< one has answered a greeting, ever: who is one does
  std::set<ContentHash> tasks_;
  std::set<ContentHash> undescribed_;  ///< of them
  std::set<ContentHash> policies_;
  std::map<protocol::RolloutKey, Open> open_;
  std::map<protocol::RolloutKey, Taken> taken_;  ///< late duplicates are compared with these
  std::deque<protocol::RolloutKey> taken_row_;   ///< oldest first
};

}  // namespace treeroll::relay
