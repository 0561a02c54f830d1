#include "workers/app/evaluator.h"

#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "common/base/cut_text.h"
#include "common/protocol/limits.h"
#include "workers/app/checked_evaluation.h"
#include "workers/app/definition_facts.h"
#include "workers/app/process_limits.h"

namespace treeroll::worker {
namespace {

using nlohmann::json;

static_assert(kTaskReportBytesMax <= protocol::kStringBytesMax);

}  // namespace

Evaluator::Evaluator(TaskSource& tasks, PolicyRegistry kinds)
    : source_(&tasks), kinds_(std::move(kinds)) {}

std::optional<protocol::DefinitionReport> Evaluator::define(const DefinitionContent& definition) {
  const auto& [name, content] = definition;
  protocol::DefinitionReport report;
  report.definition_id = name.id;
  const bool is_task = name.kind == protocol::DefinitionKind::kTask;
  is_task ? tasks_.erase(name.id) : policies_.erase(name.id);
  if (content.empty()) return std::nullopt;
  try {
    report.text = is_task ? load_task(name.id, content) : load_policy(name.id, content);
    report.accepted = true;
  } catch (const std::bad_alloc&) {
    throw;  // a want of this host, not of the roll-out: the process ends, and another tries
  } catch (const std::exception& error) {
    report.text = bounded(error.what(), protocol::kStringBytesMax);
  }
  return report;
}

std::string Evaluator::load_task(const ContentHash& id, const std::string& content) {
  json resolved;
  std::unique_ptr<EvaluatedTask> task = source_->make(content, resolved);
  const TaskDescription& description = task->description();
  std::string text = report_text(description);
  if (!description.signals.empty() && text == to_json(description).dump()) {
    spdlog::warn(
        "the names of {} inputs and {} outputs take more than the {} bytes of a report: a learner "
        "without a worker program of its own numbers them (shorter names, or --worker-program)",
        description.input_dim, description.output_dim, kTaskReportBytesMax);
  }
  tasks_.emplace(id, std::move(task));
  return text;
}

std::string Evaluator::load_policy(const ContentHash& id, const std::string& content) {
  Result<PolicyPtr> policy = kinds_.from_json(content);
  if (!policy) throw std::runtime_error(policy.error().message);
  return facts_text(*policies_.emplace(id, *std::move(policy)).first->second);
}

/// Throws std::exception where there is no such policy.
Trial Evaluator::trial_of(const protocol::RolloutRequest& request) const {
  const auto policy = policies_.find(request.policy_id);
  if (policy == policies_.end() || !tasks_.contains(request.task_id)) {
    throw std::runtime_error("it names a definition this evaluator does not have");
  }
  if (policy->second->theta_dim() != std::ssize(request.theta)) {
    throw std::runtime_error("theta has another size");
  }
  const Eigen::Map<const Eigen::VectorXd> theta(request.theta.data(), std::ssize(request.theta));
  return {.policy = policy->second->with(theta),
          .seed = static_cast<std::uint64_t>(request.task_seed),
          .run = request.key.run,
          .rollout = request.key.number};
}

Outcome Evaluator::evaluate(const protocol::RolloutRequest& request) {
  try {
    const Trial trial = trial_of(request);
    return tasks_.at(request.task_id)->evaluate(trial, nullptr);
  } catch (const std::bad_alloc&) {
    throw;  // a want of this host, not of the roll-out: the process ends, and another tries
  } catch (const std::exception& error) {
    return failed(error.what());
  }
}

/// Nothing where one by one is as good, or where one of them cannot be evaluated.
std::optional<std::vector<Outcome>> Evaluator::evaluate_side_by_side(
    std::span<const protocol::RolloutRequest> requests) {
  if (requests.size() < 2) return std::nullopt;
  const auto task = tasks_.find(requests[0].task_id);
  if (task == tasks_.end() || !task->second->side_by_side()) return std::nullopt;
  try {
    std::vector<Trial> trials;
    for (const protocol::RolloutRequest& request : requests) {
      if (request.task_id != task->first) return std::nullopt;
      trials.push_back(trial_of(request));
    }
    return task->second->evaluate_all(trials);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

protocol::RewardBatch Evaluator::answer(const protocol::RolloutBatch& batch) {
  protocol::RewardBatch answer;
  answer.last_batch = batch.sequence;
  auto start = std::chrono::steady_clock::now();
  const auto add = [&](const protocol::RolloutRequest& request, Outcome outcome,
                       std::chrono::nanoseconds duration) {
    answer.results.push_back({.key = request.key,
                              .attempt = request.attempt,
                              .content = request.content,
                              .outcome = std::move(outcome),
                              .duration_ns = duration.count()});
  };
  if (auto outcomes = evaluate_side_by_side(batch.rollouts)) {
    const std::chrono::nanoseconds duration = std::chrono::steady_clock::now() - start;
    for (std::size_t i = 0; i < outcomes->size(); ++i) {
      add(batch.rollouts[i], std::move((*outcomes)[i]), duration / std::ssize(*outcomes));
    }
    return answer;
  }
  for (const protocol::RolloutRequest& request : batch.rollouts) {
    start = std::chrono::steady_clock::now();
    Outcome outcome = evaluate(request);
    add(request, std::move(outcome), std::chrono::steady_clock::now() - start);
  }
  return answer;
}

bool become_evaluator(int parent_pid) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent_pid) return false;  // it ended before the line above
  turn_off_core_dumps();
  // A terminal's Ctrl-C and a service manager's stop reach the whole group; the daemon drains.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  return true;
}

int run_evaluator(TaskSource& tasks, int socket) {
  Evaluator evaluator(tasks);
  protocol::WorkerStatus ready;
  ready.pid = getpid();
  if (send_packet(socket, ready, true) != SendOutcome::kSent) return 1;
  for (;;) {
    tasks.attend(socket);
    const Received received = receive_packet(socket, true);
    if (received.closed) return 0;
    if (received.malformed) return 1;
    if (received.definition) {
      const auto report = evaluator.define(*received.definition);
      if (report && send_packet(socket, *report, true) != SendOutcome::kSent) return 1;
      continue;
    }
    const auto* batch = std::get_if<protocol::RolloutBatch>(&received.message.value());
    if (batch == nullptr || batch->rollouts.empty()) return 1;
    if (send_packet(socket, evaluator.answer(*batch), true) != SendOutcome::kSent) return 1;
  }
}

}  // namespace treeroll::worker
