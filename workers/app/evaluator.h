#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/policy/kinds/standard_policies.h"
#include "common/protocol/messages.h"
#include "workers/app/evaluated_task.h"
#include "workers/app/packet.h"

namespace treeroll::worker {

/// What an evaluator process does for its daemon, without the process. It keeps the
/// definitions it is given until it is told to forget them: the daemon bounds them.
class Evaluator {
 public:
  /// @param tasks  must outlive the evaluator
  explicit Evaluator(TaskSource& tasks, PolicyRegistry kinds = standard_policies());

  /// Builds it; the report says what came of it. Forgets it if the content is empty: no report.
  std::optional<protocol::DefinitionReport> define(const DefinitionContent& definition);
  /// Evaluates the roll-outs of the batch, side by side where they and their task can; last_batch
  /// of the answer is the batch's sequence. What a task throws, a reward that is not finite or
  /// outside the task's range: status kFailed.
  protocol::RewardBatch answer(const protocol::RolloutBatch& batch);

 private:
  std::string load_task(const ContentHash& id, const std::string& content);
  std::string load_policy(const ContentHash& id, const std::string& content);
  Trial trial_of(const protocol::RolloutRequest& request) const;
  Outcome evaluate(const protocol::RolloutRequest& request);
  std::optional<std::vector<Outcome>> evaluate_side_by_side(
      std::span<const protocol::RolloutRequest> requests);

  TaskSource* source_;
  PolicyRegistry kinds_;
  std::map<ContentHash, std::unique_ptr<EvaluatedTask>> tasks_;
  std::map<ContentHash, PolicyPtr> policies_;
};

/// Makes this process an evaluator: it ends with its daemon, and what the terminal sends is not for
/// it.
/// @return  false if the daemon has ended already
bool become_evaluator(int parent_pid);

/// Body of an evaluator process: handles the packets on `socket` until the daemon is gone.
/// @return  exit status
int run_evaluator(TaskSource& tasks, int socket);

}  // namespace treeroll::worker
