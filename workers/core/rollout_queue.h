#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "workers/core/worker_events.h"

namespace treeroll::worker {

/// Names a roll-out at this worker.
struct RolloutName {
  protocol::LearnerId learner = 0;
  protocol::RolloutKey key;
  auto operator<=>(const RolloutName&) const = default;
};

enum class RolloutState {
  kWaiting,  ///< for a definition
  kReady,
  kRunning,  ///< an evaluator has it
};

/// Evaluators that ended under a roll-out.
struct Mishaps {
  int num_strikes = 0;    ///< by its fault
  int num_accidents = 0;  ///< by no fault of its own
  bool alone = false;     ///< one ended under it and others: from now on it is given alone
};

struct HeldRollout {
  protocol::RolloutRequest request;
  std::int64_t sequence = 0;  ///< of the batch that asked last
  std::int64_t arrival = 0;
  TimePoint since;
  RolloutState state = RolloutState::kWaiting;
  Mishaps mishaps{};

  bool lacks_theta() const { return request.theta_id && request.theta.empty(); }
};

/// The roll-outs a worker holds. Ready ones are given out in turn between learners, and first
/// come, first served within one; a roll-out that is put back keeps its place.
class RolloutQueue {
 public:
  /// Valid until it is removed; null if absent.
  HeldRollout* find(const RolloutName& name);
  const HeldRollout* find(const RolloutName& name) const;
  /// In state kWaiting. Precondition: absent.
  HeldRollout& add(const RolloutName& name, protocol::RolloutRequest request, std::int64_t sequence,
                   TimePoint now);
  /// Precondition of both: present.
  void set_state(const RolloutName& name, RolloutState state);
  void remove(const RolloutName& name);
  bool any_ready() const;
  /// The next ready roll-out, which becomes running.
  std::optional<RolloutName> take();
  /// Ready ones of its learner and task that may be given beside it, in their order; they become
  /// running too. Only the next few are looked at, so that no packet costs a walk over all that is
  /// held.
  /// @param num_max            of these
  /// @param theta_numbers_max  in their thetas and that of the first
  std::vector<RolloutName> take_beside(const RolloutName& first, std::size_t num_max,
                                       std::size_t theta_numbers_max);

  std::size_t size() const { return held_.size(); }
  std::vector<protocol::RolloutKey> keys(protocol::LearnerId learner) const;
  const std::map<RolloutName, HeldRollout>& all() const { return held_; }
  /// How many are held of each task.
  const std::map<ContentHash, int>& tasks() const { return tasks_; }
  /// All in one state; all of one learner.
  std::vector<RolloutName> in_state(RolloutState state) const;
  std::vector<RolloutName> of_learner(protocol::LearnerId learner) const;
  /// Tasks or policies they need.
  std::set<ContentHash> definitions(DefinitionKind kind) const;
  /// All that they need.
  std::set<std::pair<protocol::LearnerId, DefinitionName>> waited_for() const;
  /// Those of a learner that wait for this theta.
  std::vector<RolloutName> without_theta(protocol::LearnerId learner, const ContentHash& id) const;
  /// Precondition: waits for its theta.
  void set_theta(const RolloutName& name, std::vector<double> theta);

 private:
  void waits_no_more(const RolloutName& name, const ContentHash& theta_id);

  std::map<RolloutName, HeldRollout> held_;
  std::map<ContentHash, int> tasks_;
  std::map<protocol::LearnerId, std::map<std::int64_t, protocol::RolloutKey>> ready_;  // by arrival
  /// Which wait for a theta. Pieces of thetas come for every worker, and no walk is made for one.
  std::map<std::pair<protocol::LearnerId, ContentHash>, std::set<protocol::RolloutKey>> thetas_;
  protocol::LearnerId last_served_ = 0;
  std::int64_t next_arrival_ = 0;
};

}  // namespace treeroll::worker
