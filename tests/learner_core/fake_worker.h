#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "learner/core/learner_core.h"

namespace treeroll::learner {

/// Reward of the tests: a smooth bump of theta, the same from every worker.
inline double bump(const std::vector<double>& theta) {
  double square = 0;
  for (std::size_t i = 0; i < theta.size(); ++i) {
    const double miss = theta[i] - .3 * static_cast<double>(i % 3);
    square += miss * miss;
  }
  return std::exp(-square);
}

inline constexpr const char* kDescription =
    R"({"deterministic":true,"input_dim":1,"output_dim":1,"reward_max":1.0,"reward_min":0.0,"time_limit_s":10.0})";

/// A worker as the protocol asks of it, evaluating one roll-out at a time in virtual time.
class FakeWorker {
 public:
  FakeWorker(protocol::WorkerId id, Duration duration) : id_(id), duration_(duration) {}

  protocol::WorkerStatus status(protocol::LearnerId learner) const {
    protocol::WorkerStatus status;
    status.worker_id = id_;
    status.host = host;
    status.pid = static_cast<std::int32_t>(id_);
    status.numeric_class = numeric_class;
    status.num_evaluators = num_evaluators;
    status.free_slots = 64 - static_cast<int>(held_.size());
    status.receive_buffer_bytes = 1 << 20;
    status.draining = draining;
    status.held.push_back({learner, last_batch_, last_index(), held_keys()});
    return status;
  }

  /// @return what it answers at once: requests for definitions, reports
  std::vector<protocol::Message> receive(const protocol::Message& message, TimePoint now) {
    std::vector<protocol::Message> replies;
    if (const auto* piece = std::get_if<protocol::DefinitionPiece>(&message)) {
      // Those of the tests are one piece each.
      known_.insert(piece->name);
      if (piece->name.kind != protocol::DefinitionKind::kTask) return replies;
      replies.emplace_back(protocol::DefinitionReport{id_, piece->learner_id, piece->name.id,
                                                      refusal.empty(),
                                                      refusal.empty() ? description : refusal});
    } else if (const auto* batch = std::get_if<protocol::RolloutBatch>(&message)) {
      const bool is_first = last_batch_ == 0;
      // In order from one learner; another one's number may be any.
      const std::int64_t step = batch->sequence - last_batch_;
      const bool follows = step >= 0 && step < protocol::kBatchBits;
      received_ = (follows ? received_ << static_cast<unsigned>(step) : 0) | 1;
      last_batch_ = batch->sequence;
      if (is_first) replies.emplace_back(status(batch->learner_id));
      for (const protocol::Acknowledgement& ack : batch->acknowledgements) {
        if (ack.worker_id != id_) continue;
        while (!unacknowledged_.empty() && first_index_ <= ack.result_index) {
          unacknowledged_.pop_front();
          ++first_index_;
        }
      }
      protocol::DefinitionRequest missing{id_, batch->learner_id, {}};
      for (const protocol::RolloutRequest& request : batch->rollouts) {
        if (request.worker_id != id_ || draining) continue;
        ++num_requests;
        for (const protocol::DefinitionName& name :
             {protocol::DefinitionName{protocol::DefinitionKind::kTask, request.task_id},
              protocol::DefinitionName{protocol::DefinitionKind::kPolicy, request.policy_id}}) {
          if (!has_all_definitions && !known_.contains(name))
            missing.definitions.push_back({name, {}});
        }
        const bool is_new = std::none_of(held_.begin(), held_.end(),
                                         [&](const auto& held) { return held.key == request.key; });
        if (!is_new) continue;
        if (held_.empty()) busy_until_ = now + duration_;
        held_.push_back(request);
      }
      if (!missing.definitions.empty()) replies.emplace_back(missing);
    }
    return replies;
  }

  protocol::WorkerId id() const { return id_; }
  bool has_work() const { return !held_.empty(); }
  TimePoint busy_until() const { return busy_until_; }

  /// Finishes the roll-out being evaluated. Precondition: has_work().
  protocol::RewardBatch finish(protocol::LearnerId learner, TimePoint now) {
    const protocol::RolloutRequest request = held_.front();
    held_.pop_front();
    busy_until_ = now + duration_;
    ++num_evaluated;
    unacknowledged_.push_back(
        {request.key, request.attempt, request.content, outcome(request), duration_.count()});
    protocol::RewardBatch batch;
    batch.worker_id = id_;
    batch.learner_id = learner;
    batch.last_batch = last_batch_;
    batch.free_slots = 64 - static_cast<int>(held_.size());
    batch.first_index = first_index_;
    batch.batches_received = static_cast<std::int64_t>(received_);
    batch.oldest_index = first_index_;
    batch.results.assign(unacknowledged_.begin(), unacknowledged_.end());
    return batch;
  }

  std::string description = kDescription;  ///< of every task
  std::string refusal;                     ///< of every task, if not empty
  std::string host = "host";
  std::string numeric_class = "class";
  double reward_factor = 1;
  RolloutStatus result_status = RolloutStatus::kOk;
  std::string reason;
  int discards_one_in = 0;  ///< of so many trials, by their seed; 0: none
  bool draining = false;
  bool has_all_definitions = false;  ///< from another learner: it asks for none
  int num_evaluators = 1;
  int num_requests = 0;
  int num_evaluated = 0;

 private:
  Outcome outcome(const protocol::RolloutRequest& request) const {
    const auto seed = static_cast<std::uint64_t>(request.task_seed);
    if (discards_one_in > 0 && seed % static_cast<std::uint64_t>(discards_one_in) == 0) {
      return Outcome::discarded("void");
    }
    return {bump(request.theta) * reward_factor, result_status, reason};
  }
  std::int64_t last_index() const {
    return first_index_ + static_cast<std::int64_t>(unacknowledged_.size()) - 1;
  }
  std::vector<protocol::RolloutKey> held_keys() const {
    std::vector<protocol::RolloutKey> keys;
    for (const auto& request : held_) keys.push_back(request.key);
    return keys;
  }

  protocol::WorkerId id_;
  Duration duration_;
  std::set<protocol::DefinitionName> known_;
  std::deque<protocol::RolloutRequest> held_;
  std::deque<protocol::RolloutResult> unacknowledged_;
  std::int64_t first_index_ = 1;
  std::int64_t last_batch_ = 0;
  std::uint64_t received_ = 0;
  TimePoint busy_until_;
};

}  // namespace treeroll::learner
