#include "tests/benchmarks/peer_rollouts.h"

#include <nlohmann/json.hpp>

#include "common/base/check.h"
#include "common/base/config_error.h"
#include "learner/study/study_file.h"
#include "workers/app/task_content.h"

namespace treeroll::benchmarks {

PeerRollouts::PeerRollouts(const std::string& study, const std::vector<std::string>& overrides) {
  const Condition condition = load_study(study, overrides).study.conditions.at(0);
  start_ = condition.start;
  theta_ = start_->theta();
  if (theta_.size() > kPeerThetaMax) {
    throw ConfigError("policy", std::to_string(theta_.size()),
                      "must have a theta of at most " + std::to_string(kPeerThetaMax));
  }
  TaskRegistry registry;
  add_standard_tasks(registry);
  nlohmann::json resolved;
  task_ = worker::make_task(registry, condition.task_content, resolved);
}

PeerRequest PeerRollouts::request(std::int64_t number) const {
  // Cheap on purpose: a pool's master learns nothing.
  PeerRequest request;
  request.number = number;
  for (Eigen::Index i = 0; i < theta_.size(); ++i) {
    request.theta[i] = theta_[i] + 1e-3 * static_cast<double>((number + i) % 97);
  }
  return request;
}

PeerResult PeerRollouts::evaluate(const PeerRequest& request) {
  const Eigen::VectorXd theta = Eigen::Map<const Eigen::VectorXd>(request.theta, theta_.size());
  const auto controller = start_->with(theta)->controller();
  const Outcome outcome = task_->evaluate(*controller, 0);
  CHECK(outcome.is_ok(), outcome.reason());
  return {request.number, outcome.reward()};
}

}  // namespace treeroll::benchmarks
