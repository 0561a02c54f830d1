#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "common/base/time.h"
#include "common/protocol/messages.h"
#include "tests/simulation/schedule.h"

namespace treeroll::simulation {

/// What a simulation has seen: how often each fault fired, and the first broken invariant.
class Observer {
 public:
  explicit Observer(const Schedule& schedule) : schedule_(schedule) {}

  void count(const std::string& fault, std::int64_t times = 1) { faults_[fault] += times; }
  const std::map<std::string, std::int64_t>& faults() const { return faults_; }

  /// Notes the broken rule unless one is broken already.
  void require(bool holds, const std::string& rule) {
    if (holds || broken()) return;
    violation_ =
        "after " + std::to_string(to_seconds(schedule_.now() - TimePoint{})) + " s: " + rule;
  }
  bool broken() const { return !violation_.empty(); }
  const std::string& violation() const { return violation_; }

  std::int64_t num_simulations = 0;  ///< begun by an evaluator
  std::int64_t num_reissued = 0;
  std::int64_t num_messages_heard = 0;  ///< by learners
  std::int64_t num_heartbeats = 0;      ///< of these
  std::set<protocol::WorkerId> liars;
  /// Which question each answer of a worker to a learner was for, by its index, until acknowledged.
  using Question = std::pair<protocol::RolloutKey, std::int64_t>;  ///< with its content
  std::map<std::pair<protocol::WorkerId, protocol::LearnerId>, std::map<std::int64_t, Question>>
      answers;
  /// The last index up to which they were said to be settled.
  std::map<std::pair<protocol::WorkerId, protocol::LearnerId>, std::int64_t> settled;

 private:
  const Schedule& schedule_;
  std::map<std::string, std::int64_t> faults_;
  std::string violation_;
};

}  // namespace treeroll::simulation
