#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/policy/tree/tree_policy.h"
#include "common/transport/bus.h"
#include "common/transport/loop.h"
#include "tests/worker_app/child.h"

namespace treeroll::worker {

/// One Gaussian over one input and one output; its theta has three numbers.
TreePolicy small_policy();

/// A synthetic task's definition with these settings, such as R"({"mode": "sleep"})".
std::string synthetic_task(const std::string& settings);

/// The learner's side of the messages, without learning: asks one worker and keeps what it says.
class LearnerStandIn {
 public:
  explicit LearnerStandIn(int salt);

  const std::string& url() const { return url_; }
  /// Runs the loop until `done()`, at most `limit`. Returns done().
  bool until(const std::function<bool()>& done,
             std::chrono::milliseconds limit = std::chrono::seconds(20));
  /// Waits until a worker says it has room: what it is asked before, it does not take.
  bool meet_worker();
  void define(const std::string& task);
  void define_policy(const Policy& policy);
  /// Asks for roll-outs number first .. first + n - 1, under the last definitions.
  void ask(int first, int num);
  /// Asks for one whose theta comes in pieces.
  void ask_with_theta(int number, const ContentHash& theta_id);
  void acknowledge();
  /// As if so many batches were lost.
  void skip_batches(int num);
  void send(const protocol::Message& message) { bus_->publish(message); }
  const protocol::RolloutResult* result(int number) const;

  std::vector<protocol::RewardBatch> rewards;
  std::vector<protocol::DefinitionRequest> requests;
  std::vector<protocol::DefinitionReport> reports;
  std::optional<protocol::WorkerStatus> status;
  std::vector<std::int64_t> skipped;  ///< sequences of batches that were

 private:
  void publish(protocol::DefinitionKind kind, const std::string& content);
  void receive(const protocol::Message& message);

  std::string url_;
  transport::Loop loop_;
  std::unique_ptr<transport::Bus> bus_;
  std::int64_t sequence_ = 0;
  std::string task_;
  std::string policy_;
  std::int64_t last_index_ = 0;
};

}  // namespace treeroll::worker
