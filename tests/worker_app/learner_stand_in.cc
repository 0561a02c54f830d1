#include "tests/worker_app/learner_stand_in.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/protocol/pieces.h"
#include "tests/transport/loopback.h"

namespace treeroll::worker {
namespace {

constexpr protocol::LearnerId kLearner = 4711;

}  // namespace

TreePolicy small_policy() {
  Component component;
  component.prior = 1;
  component.mean = Eigen::Vector2d(.5, .25);
  component.covariance = Eigen::Matrix2d{{1, .5}, {.5, 1}};
  return {TreeModel::from_global(FrameKind::kCholesky, {Gmm(1, {component})}, {{}}), 1,
          ThetaLayout::kMeansCholesky};
}

std::string synthetic_task(const std::string& settings) {
  return R"({"name":"synthetic","settings":)" + settings + "}";
}

LearnerStandIn::LearnerStandIn(int salt) : url_(transport::loopback_url(salt)) {
  using transport::Channel;
  auto opened =
      transport::open_bus(loop_, {url_,
                                  {Channel::kRewardBatch, Channel::kWorkerStatus,
                                   Channel::kDefinitionRequest, Channel::kDefinitionReport},
                                  [this](const protocol::Message& message) { receive(message); }});
  CHECK(opened, opened.error().message);
  bus_ = *std::move(opened);
  policy_ = to_json(small_policy());
}

bool LearnerStandIn::until(const std::function<bool()>& done, std::chrono::milliseconds limit) {
  return transport::run_until(loop_, done, limit);
}

bool LearnerStandIn::meet_worker() {
  return until([&] { return status && status->free_slots > 0; });
}

void LearnerStandIn::define(const std::string& task) {
  task_ = task;
  publish(protocol::DefinitionKind::kTask, task_);
  publish(protocol::DefinitionKind::kPolicy, policy_);
}

void LearnerStandIn::publish(protocol::DefinitionKind kind, const std::string& content) {
  for (int index = 0; index < protocol::num_pieces(content.size()); ++index) {
    bus_->publish(
        protocol::definition_piece(kLearner, {kind, content_hash(content)}, content, index));
  }
}

void LearnerStandIn::define_policy(const Policy& policy) {
  policy_ = to_json(policy);
  publish(protocol::DefinitionKind::kPolicy, policy_);
}

void LearnerStandIn::ask(int first, int num) {
  protocol::RolloutBatch batch{kLearner, ++sequence_, {}, {}};
  for (int i = first; i < first + num; ++i) {
    protocol::RolloutRequest request;
    request.worker_id = status->worker_id;
    request.key = {0, i};
    request.content = 1000 + i;
    request.task_id = content_hash(task_);
    request.policy_id = content_hash(policy_);
    request.theta = {1, 1, .1 * i};
    batch.rollouts.push_back(request);
  }
  bus_->publish(batch);
}

void LearnerStandIn::ask_with_theta(int number, const ContentHash& theta_id) {
  protocol::RolloutRequest request;
  request.worker_id = status->worker_id;
  request.key = {0, number};
  request.content = 1000 + number;
  request.task_id = content_hash(task_);
  request.policy_id = content_hash(policy_);
  request.theta_id = theta_id;
  bus_->publish(protocol::RolloutBatch{kLearner, ++sequence_, {request}, {}});
}

void LearnerStandIn::skip_batches(int num) {
  for (int i = 0; i < num; ++i) skipped.push_back(++sequence_);
}

void LearnerStandIn::acknowledge() {
  bus_->publish(protocol::RolloutBatch{
      kLearner, ++sequence_, {}, {{status->worker_id, last_index_, last_index_}}});
}

const protocol::RolloutResult* LearnerStandIn::result(int number) const {
  for (const auto& batch : rewards) {
    for (const auto& result : batch.results) {
      if (result.key.number == number) return &result;
    }
  }
  return nullptr;
}

void LearnerStandIn::receive(const protocol::Message& message) {
  if (const auto* reward = std::get_if<protocol::RewardBatch>(&message)) {
    rewards.push_back(*reward);
    last_index_ = std::max(
        last_index_, reward->first_index + static_cast<std::int64_t>(reward->results.size()) - 1);
  } else if (const auto* heartbeat = std::get_if<protocol::WorkerStatus>(&message)) {
    status = *heartbeat;
  } else if (const auto* request = std::get_if<protocol::DefinitionRequest>(&message)) {
    requests.push_back(*request);
  } else if (const auto* report = std::get_if<protocol::DefinitionReport>(&message)) {
    reports.push_back(*report);
  }
}

}  // namespace treeroll::worker
