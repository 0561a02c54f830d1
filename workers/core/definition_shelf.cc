#include "workers/core/definition_shelf.h"

#include <fmt/format.h>

#include <array>
#include <set>

#include "common/protocol/limits.h"

namespace treeroll::worker {
namespace {

constexpr std::array<const char*, protocol::kNumDefinitionKinds> kWords = {"task", "policy",
                                                                           "theta"};

}  // namespace

DefinitionShelf::DefinitionShelf(const WorkerSettings& settings)
    : settings_(settings),
      pieces_(settings.num_partial_max, settings.partial_bytes_max),
      tasks_(settings.num_tasks_max, settings.definition_bytes_max),
      policies_(settings.num_policies_max, settings.definition_bytes_max) {}

const Definition* DefinitionShelf::find(const DefinitionName& name) const {
  return (name.kind == DefinitionKind::kTask ? tasks_ : policies_).find(name.id);
}

void DefinitionShelf::touch(const DefinitionName& name) {
  if (find(name) != nullptr) cache(name.kind).touch(name.id);
}

void DefinitionShelf::receive(const Turn& turn, const protocol::DefinitionPiece& piece,
                              const RolloutQueue& held) {
  const DefinitionName& name = piece.name;
  Definition* definition = cache(name.kind).find(name.id);
  // Who drains takes nothing new, but what it has it is asked about: its last answers may wait for
  // that.
  if (closed_ && definition == nullptr) return;
  if (definition != nullptr) {
    // All of it may come again for others: one word is enough.
    if (piece.index != 0) return;
    cache(name.kind).touch(name.id);
  } else {
    std::optional<std::string> content = assemble(turn, piece, held);
    if (!content) return;
    definition = take(name, *std::move(content), held);
    if (definition == nullptr) return;  // all in use: asked for again while it is waited for
  }
  const protocol::LearnerId learner = piece.learner_id;
  if (definition->to_tell.size() < settings_.num_learners_max) definition->to_tell.insert(learner);
  const bool settled = definition->state == DefinitionState::kAccepted ||
                       definition->state == DefinitionState::kRefused;
  if (settled) settle(name, *definition);
}

std::optional<std::string> DefinitionShelf::assemble(const Turn& turn,
                                                     const protocol::DefinitionPiece& piece,
                                                     const RolloutQueue& held) {
  PieceTable::Added added = pieces_.add(piece, [&held] { return held.waited_for(); });
  if (!added.refusal.empty()) {
    ++num_rejected_;
    turn.warn(
        "definitions refused",
        fmt::format("{} {} of learner {}: {}", kWords.at(static_cast<std::size_t>(piece.name.kind)),
                    to_hex(piece.name.id), piece.learner_id, added.refusal));
  }
  return std::move(added.whole);
}

/// Null if there is no room.
Definition* DefinitionShelf::take(const DefinitionName& name, std::string content,
                                  const RolloutQueue& held) {
  Definition* definition =
      cache(name.kind).insert(name.id, std::move(content), held.definitions(name.kind));
  if (definition == nullptr) return nullptr;
  to_check_.push_back(name);
  forget_stale_checks();
  return definition;
}

std::optional<DefinitionName> DefinitionShelf::take_unchecked(
    const std::set<DefinitionName>* among) {
  for (auto it = to_check_.begin(); it != to_check_.end();) {
    const DefinitionName name = *it;
    if (among != nullptr && !among->contains(name)) {
      ++it;
      continue;
    }
    it = to_check_.erase(it);
    Definition* definition = cache(name.kind).find(name.id);
    // It may have been evicted meanwhile.
    if (definition == nullptr || definition->state != DefinitionState::kUnchecked) continue;
    definition->state = DefinitionState::kChecking;
    return name;
  }
  return std::nullopt;
}

void DefinitionShelf::on_checked(const Turn& turn, const DefinitionLoaded& result) {
  Definition* definition = cache(result.name.kind).find(result.name.id);
  if (definition == nullptr) return;
  // A relay's workers may describe a task otherwise, most of them, than the first one did.
  const bool is_news = definition->state == DefinitionState::kAccepted && result.accepted &&
                       definition->text != result.text;
  if (definition->state != DefinitionState::kChecking && !is_news) return;
  if (is_news) definition->to_tell = definition->told;
  if (!result.accepted) return refuse(turn, result.name, *definition, result.text);
  definition->state = DefinitionState::kAccepted;
  definition->text = result.text;
  definition->facts = result.facts;
  settle(result.name, *definition);
}

void DefinitionShelf::on_strike(const Turn& turn, const DefinitionName& name, bool timed_out) {
  Definition& definition = *cache(name.kind).find(name.id);
  if (++definition.num_strikes < settings_.num_strikes_max) return check_first(name, definition);
  refuse(turn, name, definition,
         fmt::format("loading it {} {} evaluators", timed_out ? "took too long for" : "crashed",
                     definition.num_strikes));
}

void DefinitionShelf::on_accident(const DefinitionName& name) {
  check_first(name, *cache(name.kind).find(name.id));
}

void DefinitionShelf::forget_refused() {
  tasks_.erase_refused();
  policies_.erase_refused();
}

void DefinitionShelf::close() {
  closed_ = true;
  to_check_.clear();
}

void DefinitionShelf::report(protocol::LearnerId learner, const ContentHash& id, bool accepted,
                             const std::string& text) {
  const auto earlier = reports_.find({learner, id});
  if (earlier != reports_.end() && !earlier->second.accepted) return;
  if (earlier == reports_.end() && reports_.size() >= protocol::kReportsPerTurnMax) return;
  reports_[{learner, id}] = {.worker_id = settings_.worker_id,
                             .learner_id = learner,
                             .definition_id = id,
                             .accepted = accepted,
                             .text = text};
}

void DefinitionShelf::on_evaluated(const DefinitionName& task, Duration duration) {
  Definition* definition = tasks_.find(task.id);
  if (definition == nullptr) return;
  Duration& usual = definition->rollout_time;
  usual = usual == Duration{} ? duration : usual + (duration - usual) / 8;
}

void DefinitionShelf::send_reports(const Turn& turn) {
  for (auto& [key, report] : reports_) turn.effects.emplace_back(SendMessage{std::move(report)});
  reports_.clear();
}

DefinitionCache& DefinitionShelf::cache(DefinitionKind kind) {
  return kind == DefinitionKind::kTask ? tasks_ : policies_;
}

void DefinitionShelf::check_first(const DefinitionName& name, Definition& definition) {
  definition.state = DefinitionState::kUnchecked;
  if (!closed_) to_check_.push_front(name);
}

void DefinitionShelf::refuse(const Turn& turn, const DefinitionName& name, Definition& definition,
                             std::string reason) {
  cache(name.kind).refuse(definition, std::move(reason));
  turn.warn("definitions refused",
            fmt::format("refuses definition {}: {}", to_hex(name.id), definition.text));
  settle(name, definition);
}

void DefinitionShelf::settle(const DefinitionName& name, Definition& definition) {
  const bool accepted = definition.state == DefinitionState::kAccepted;
  // Of a policy no news is good news: as many words as workers times policies would say nothing.
  const bool is_news = !accepted || name.kind == DefinitionKind::kTask;
  for (const protocol::LearnerId learner : definition.to_tell) {
    if (is_news) report(learner, name.id, accepted, definition.text);
  }
  // Learners that are gone are in it too: those of today begin it anew.
  if (definition.told.size() + definition.to_tell.size() > settings_.num_learners_max) {
    definition.told.clear();
  }
  definition.told.merge(definition.to_tell);
  definition.to_tell.clear();
  settled_ = true;
}

/// What was evicted unchecked stays named in the row of what is to be checked. While no evaluator
/// is idle, a flood of definitions would make it grow.
void DefinitionShelf::forget_stale_checks() {
  if (to_check_.size() <= 2 * (settings_.num_tasks_max + settings_.num_policies_max)) return;
  std::set<DefinitionName> seen;
  std::erase_if(to_check_, [&](const DefinitionName& name) {
    const Definition* definition = find(name);
    const bool waits = definition != nullptr && definition->state == DefinitionState::kUnchecked;
    return !waits || !seen.insert(name).second;
  });
}

}  // namespace treeroll::worker
