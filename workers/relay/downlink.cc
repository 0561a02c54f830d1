#include "workers/relay/downlink.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/protocol/limits.h"

namespace treeroll::relay {
namespace {

/// For so long all workers count that may hear: those that do answer one after the other, and what
/// the first of them have no room for would be dropped.
constexpr Duration kIntroduction = std::chrono::seconds(1);

}  // namespace

Downlink::Downlink(TimePoint now, protocol::LearnerId above,
                   const learner::LearnerSettings& settings, News& news)
    : above_(above),
      below_(settings.learner_id),
      news_(news),
      workforce_(settings, *this),
      introduced_(now + kIntroduction),
      heard_above_(now) {}

void Downlink::check_task(const learner::Turn& turn, const std::string& content) {
  const ContentHash id = content_hash(content);
  if (!tasks_.contains(id)) return add_task(turn, id, content);
  if (const TaskDescription* facts = workforce_.facts_of(id)) {
    take_facts(turn, id, *facts);
  } else {
    undescribed_.insert(id);
    workforce_.start(turn);
  }
}

void Downlink::add_task(const learner::Turn& turn, const ContentHash& id,
                        const std::string& content) {
  const ContentHash added = workforce_.add_task(content);
  CHECK(added == id, "a task is not what its id names");
  tasks_.insert(id);
  undescribed_.insert(id);
  workforce_.start(turn);  // sends it
}

void Downlink::ask(const learner::Turn& turn, const protocol::RolloutRequest& request,
                   const std::string& task, const std::string& policy) {
  if (!tasks_.contains(request.task_id)) add_task(turn, request.task_id, task);
  if (policies_.insert(request.policy_id).second) {
    const ContentHash added = workforce_.add_policy(turn, policy);
    CHECK(added == request.policy_id, "a policy is not what its id names");
  }
  learner::Question question;
  question.task_id = request.task_id;
  question.policy_id = request.policy_id;
  question.task_seed = request.task_seed;
  question.content = request.content;  // as the learner has sealed it
  question.theta = Eigen::Map<const Eigen::VectorXd>(
      request.theta.data(), static_cast<Eigen::Index>(request.theta.size()));
  workforce_.ask(request.key, std::move(question));
  open_.emplace(request.key, Open{request.task_id, request.policy_id, {}});
}

void Downlink::withdraw(protocol::RolloutKey key) {
  if (open_.erase(key) > 0) workforce_.withdraw(key);
}

void Downlink::leave() {
  for (const ContentHash& id : undescribed_) refuse(id, "its learner has gone");
  undescribed_.clear();
}

void Downlink::refuse(const ContentHash& task, std::string reason) {
  news_.verdicts.push_back({.name = {worker::DefinitionKind::kTask, task},
                            .accepted = false,
                            .text = std::move(reason),
                            .facts = {}});
}

void Downlink::give_up_all() {
  for (const auto& [key, open] : open_) {
    workforce_.withdraw(key);
    news_.ends.emplace_back(worker::WorkGivenUp{name(key)});
  }
  open_.clear();
}

Standing Downlink::standing_of(protocol::WorkerId id, TimePoint now) const {
  using Use = Standing::Use;
  const Use use_of_stranger = now < introduced_   ? Use::kNow
                              : !has_met_workers_ ? Use::kPerhaps
                                                  : Use::kNone;
  const auto& workers = workforce_.workers().all();
  const auto known = workers.find(id);
  if (known == workers.end()) return {.use = use_of_stranger};
  const learner::WorkerEntry& worker = known->second;
  const bool is_in_order = worker.num_evaluators > 0 && !worker.draining && !worker.distrusted &&
                           !worker.refuses_too_much() && !worker.hearing.seems_deaf(now);
  Standing standing{.use = Use::kNone,
                    .has_answered_a_greeting = worker.has_answered_a_greeting(),
                    .num_accepted = worker.num_accepted};
  if (is_in_order) standing.use = worker.joined ? Use::kPerhaps : use_of_stranger;
  if (worker.usable()) standing.use = Use::kNow;
  return standing;
}

void Downlink::drain() {
  workforce_.give_out_no_more();
  const std::deque<protocol::RolloutKey> ready = workforce_.ledger().ready();
  for (const protocol::RolloutKey key : ready) {
    withdraw(key);
    news_.ends.emplace_back(worker::WorkPutBack{name(key), {}});
  }
}

protocol::LearnerStatus Downlink::passed_on(TimePoint now, protocol::LearnerStatus status) {
  status.learner_id = below_;
  status.num_workers = workforce_.count_workers(now);
  status.num_evaluators = workforce_.workers().num_evaluators();
  return status;
}

void Downlink::receive(const learner::Turn& turn, const protocol::Message& message) {
  workforce_.receive(turn, message);
  const auto* report = std::get_if<protocol::DefinitionReport>(&message);
  if (report != nullptr && !report->accepted) look_for_refusals();
}

void Downlink::remind(const learner::Turn& turn) {
  workforce_.remind(turn);
  has_met_workers_ = has_met_workers_ || workforce_.workers().num_joined() > 0;
  look_for_refusals();
}

void Downlink::dispatch(const learner::Turn& turn) {
  // There is no disk to wait for.
  workforce_.begin_sync();
  workforce_.end_sync(turn.now);
  workforce_.dispatch(turn);
}

/// What each usable worker refuses: the learner is told, and gives its roll-outs to others.
void Downlink::look_for_refusals() {
  std::map<ContentHash, std::optional<std::string>> looked_at;
  const auto refusal = [&](const ContentHash& id) -> const std::optional<std::string>& {
    const auto [place, is_new] = looked_at.try_emplace(id);
    if (!is_new) return place->second;
    place->second = workforce_.refused_by_all(id);
    if (place->second) news_.refusals.push_back({above_, id, *place->second});
    return place->second;
  };
  // Told once: check_task() asks again.
  std::erase_if(undescribed_, [&](const ContentHash& id) {
    const std::optional<std::string>& reason = refusal(id);
    if (reason) refuse(id, *reason);
    return reason.has_value();
  });
  for (auto it = open_.begin(); it != open_.end();) {
    const auto& [key, open] = *it;
    const bool is_refused = refusal(open.task_id) || refusal(open.policy_id);
    if (is_refused) {
      workforce_.withdraw(key);
      news_.ends.emplace_back(worker::WorkGivenUp{name(key)});
    }
    it = is_refused ? open_.erase(it) : std::next(it);
  }
}

void Downlink::keep_only(const worker::DefinitionShelf& definitions) {
  std::erase_if(policies_, [&](const ContentHash& id) {
    const bool is_gone = definitions.find({worker::DefinitionKind::kPolicy, id}) == nullptr;
    if (is_gone) workforce_.release_policy(id);
    return is_gone;
  });
}

std::optional<ContentHash> Downlink::task_of(protocol::RolloutKey key) const {
  if (const auto open = open_.find(key); open != open_.end()) return open->second.task_id;
  const auto taken = taken_.find(key);
  return taken == taken_.end() ? std::nullopt : std::optional(taken->second.task_id);
}

std::optional<learner::Answer> Downlink::answer_of(protocol::RolloutKey key) const {
  const auto taken = taken_.find(key);
  return taken == taken_.end() ? std::nullopt : std::optional(taken->second.answer);
}

void Downlink::take(const learner::Turn&, const AcceptedResult& result, int numeric_class) {
  const auto open = open_.extract(result.key);
  CHECK(!open.empty(), "an answer to what is not open");
  const bool is_new = taken_
                          .insert_or_assign(result.key, Taken{open.mapped().task_id,
                                                              {result.outcome, numeric_class}})
                          .second;
  if (is_new) taken_row_.push_back(result.key);
  if (taken_row_.size() > protocol::kAnswersMax) {
    taken_.erase(taken_row_.front());
    taken_row_.pop_front();
  }
  news_.ends.emplace_back(worker::WorkAnswered{.name = name(result.key),
                                               .outcome = result.outcome,
                                               .duration_ns = result.duration_ns.value_or(0)});
}

std::optional<std::string> Downlink::take_facts(const learner::Turn&, const ContentHash& task_id,
                                                const TaskDescription& facts) {
  undescribed_.erase(task_id);
  // Workers below keep the time, and find out what does not go together.
  constexpr Duration kNever = std::chrono::hours(24 * 100);
  news_.verdicts.push_back({.name = {worker::DefinitionKind::kTask, task_id},
                            .accepted = true,
                            .text = report_text(facts),
                            .facts = {.input_dim = facts.input_dim,
                                      .output_dim = facts.output_dim,
                                      .time_limit = kNever,
                                      .repeatable = facts.repeatable}});
  return std::nullopt;
}

}  // namespace treeroll::relay
