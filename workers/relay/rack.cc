#include "workers/relay/rack.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/base/check.h"
#include "common/base/content_hash.h"

namespace treeroll::relay {
namespace {

using protocol::LearnerId;

/// What all workers below have refused is asked of them again after this: others may have come.
constexpr Duration kRefusalLasts = std::chrono::seconds(60);

/// A learner's name below: no other relay, learner or time of serving it has the same.
LearnerId id_below(protocol::WorkerId relay, LearnerId learner, std::int64_t number) {
  std::string bytes;
  for (const std::int64_t part : {relay, learner, number}) {
    bytes.append(reinterpret_cast<const char*>(&part), sizeof part);
  }
  return (short_form(content_hash(bytes)) & std::numeric_limits<std::int64_t>::max()) | 1;
}

}  // namespace

void Rack::drain() {
  draining_ = true;
  for (auto& [id, downlink] : downlinks_) downlink.drain();
}

std::optional<int> Rack::idle_evaluator() const {
  return draining_ ? std::nullopt : std::optional(0);
}

/// By whichever learners wait for the verdict: they send it, and its report goes to them.
void Rack::check(const worker::Turn& turn, int, const worker::DefinitionName& name,
                 const worker::DefinitionShelf& definitions) {
  const worker::Definition& definition = *definitions.find(name);
  if (name.kind == worker::DefinitionKind::kPolicy) {
    // It goes down with its roll-outs; a worker that cannot read it refuses it.
    news_.verdicts.push_back({.name = name, .accepted = true, .text = {}, .facts = {}});
    return;
  }
  bool is_asked = false;
  for (const LearnerId learner : definition.to_tell) {
    Downlink* downlink = serve(turn.now, learner);
    if (downlink == nullptr) continue;
    downlink->check_task(turn_at(turn.now), definition.content);
    is_asked = true;
  }
  if (!is_asked) {
    news_.verdicts.push_back({.name = name,
                              .accepted = false,
                              .text = "the relay serves as many learners as it may",
                              .facts = {}});
  }
}

void Rack::evaluate(const worker::Turn& turn, int, std::vector<worker::Work> works,
                    worker::DefinitionShelf& definitions) {
  for (worker::Work& work : works) {
    const protocol::RolloutRequest& request = work.request;
    Downlink* downlink = serve(turn.now, work.name.learner);
    if (downlink == nullptr) {
      news_.ends.emplace_back(worker::WorkGivenUp{work.name});
      continue;
    }
    const worker::DefinitionName task{worker::DefinitionKind::kTask, request.task_id};
    const worker::DefinitionName policy{worker::DefinitionKind::kPolicy, request.policy_id};
    definitions.touch(task);
    definitions.touch(policy);
    downlink->ask(turn_at(turn.now), request, definitions.find(task)->content,
                  definitions.find(policy)->content);
  }
}

void Rack::withdraw(const worker::RolloutName& name) {
  if (Downlink* downlink = find(name.learner)) downlink->withdraw(name.key);
  // What has come of it and has not been taken up is nobody's any more.
  std::erase_if(news_.ends, [&](const worker::WorkEnd& end) {
    return std::visit([&](const auto& what) { return what.name == name; }, end);
  });
}

std::vector<worker::WorkEnd> Rack::on(const worker::Turn& turn, const worker::EvaluatorEvent&,
                                      worker::DefinitionShelf& definitions) {
  count_ = next_count_;
  looks_ = false;
  for (worker::DefinitionLoaded& verdict : news_.verdicts) {
    definitions.on_checked(turn, verdict);
    if (!verdict.accepted && !std::exchange(forgets_refusals_, true)) {
      refusals_end_ = turn.now + kRefusalLasts;
    }
  }
  if (forgets_refusals_ && turn.now >= refusals_end_) {
    forgets_refusals_ = false;
    definitions.forget_refused();
  }
  for (const News::Refusal& refusal : news_.refusals) {
    definitions.report(refusal.learner, refusal.definition, false, refusal.reason);
  }
  if (std::exchange(num_evicted_seen_, definitions.num_evicted()) != definitions.num_evicted()) {
    for (auto& [id, downlink] : downlinks_) downlink.keep_only(definitions);
  }
  return std::exchange(news_, {}).ends;
}

void Rack::set_count(int count) {
  next_count_ = count;
  // Else what they had would be kept from all others until one comes.
  if (next_count_ == 0) {
    for (auto& [id, downlink] : downlinks_) downlink.give_up_all();
  }
}

void Rack::receive(TimePoint now, const protocol::Message& message) {
  const learner::Turn turn = turn_at(now);
  for (auto& [id, downlink] : downlinks_) downlink.receive(turn, message);
}

std::optional<Standing> Rack::standing_of(protocol::WorkerId worker, TimePoint now) const {
  std::optional<Standing> best;
  for (const auto& [id, downlink] : downlinks_) {
    const Standing one = downlink.standing_of(worker, now);
    if (!best) best = one;
    best->use = std::max(best->use, one.use);
    best->has_answered_a_greeting |= one.has_answered_a_greeting;
    best->num_accepted = std::max(best->num_accepted, one.num_accepted);
  }
  return best;
}

void Rack::pass_on(TimePoint now, const protocol::LearnerStatus& status) {
  Downlink* downlink = find(status.learner_id);
  if (downlink == nullptr) return;
  downlink->hear_above(now);
  effects_.emplace_back(learner::SendMessage{downlink->passed_on(now, status)});
}

void Rack::hear(TimePoint now, LearnerId learner) {
  if (Downlink* downlink = find(learner)) downlink->hear_above(now);
}

void Rack::on_timer(TimePoint now) {
  for (auto& [id, downlink] : downlinks_) downlink.look_after_leases(turn_at(now));
}

void Rack::remind(TimePoint now) {
  const learner::Turn turn = turn_at(now);
  for (auto it = downlinks_.begin(); it != downlinks_.end();) {
    Downlink& downlink = it->second;
    const bool is_gone =
        downlink.num_open() == 0 && now >= downlink.heard_above() + settings_.learner_silence_max;
    is_gone ? downlink.leave() : downlink.remind(turn);
    it = is_gone ? downlinks_.erase(it) : std::next(it);
  }
  if (forgets_refusals_ && now >= refusals_end_) looks_ = true;
  turn.log_due();
}

void Rack::dispatch(TimePoint now) {
  for (auto& [id, downlink] : downlinks_) downlink.dispatch(turn_at(now));
}

std::optional<TimePoint> Rack::downlink_deadline() const {
  std::optional<TimePoint> next;
  for (const auto& [id, downlink] : downlinks_) {
    const std::optional<TimePoint> one = downlink.next_deadline();
    if (one && (!next || *one < *next)) next = one;
  }
  return next;
}

Downlink* Rack::find(LearnerId learner) {
  const auto found = downlinks_.find(learner);
  return found == downlinks_.end() ? nullptr : &found->second;
}

/// Null if there is no room.
Downlink* Rack::serve(TimePoint now, LearnerId learner) {
  if (Downlink* known = find(learner)) return known;
  if (downlinks_.size() >= settings_.num_learners_max && !make_room()) return nullptr;
  learner::LearnerSettings settings;
  settings.learner_id = id_below(settings_.relay_id, learner, num_served_++);
  settings.batch_bytes_max = settings_.batch_bytes_max;
  settings.word_bytes = settings_.word_bytes;
  settings.is_authenticated = settings_.word_bytes > 0;
  Downlink& served = downlinks_.try_emplace(learner, now, learner, settings, news_).first->second;
  if (draining_) served.drain();
  return &served;
}

/// The most silent one that has nothing here goes.
bool Rack::make_room() {
  auto victim = downlinks_.end();
  for (auto it = downlinks_.begin(); it != downlinks_.end(); ++it) {
    if (it->second.num_open() > 0) continue;
    const bool is_first = victim == downlinks_.end();
    if (is_first || it->second.heard_above() < victim->second.heard_above()) victim = it;
  }
  if (victim == downlinks_.end()) return false;
  victim->second.leave();
  downlinks_.erase(victim);
  return true;
}

}  // namespace treeroll::relay
