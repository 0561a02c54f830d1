// What a worker core lacks: what it asks for, and thetas that come in pieces.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "common/protocol/pieces.h"
#include "common/protocol/wire_sizes.h"
#include "workers/core/worker_core.h"

namespace treeroll::worker {
namespace {

/// Requests for definitions in one go; what finds no room in them is asked for next time.
constexpr int kRequestsPerAskMax = 4;

/// Names what is missing in as few messages as hold it.
class RequestWriter {
 public:
  RequestWriter(protocol::DefinitionRequest empty, std::size_t bytes_max)
      : empty_(std::move(empty)),
        room_max_(bytes_max - protocol::kFrameBytesMax - protocol::kDefinitionRequestBytes) {}

  /// False if there is no room left for all of it.
  bool add(const DefinitionName& name, std::span<const std::int32_t> pieces) {
    do {
      const bool fits =
          !requests_.empty() && room_ >= protocol::wanted_definition_bytes(1) &&
          requests_.back().definitions.size() < std::size_t{protocol::kDefinitionsPerRequestMax};
      if (!fits && !begin()) return false;
      const std::size_t num_fit =
          std::min(pieces.size(), (room_ - protocol::wanted_definition_bytes(0)) / 4);
      const auto some = pieces.first(num_fit);
      requests_.back().definitions.push_back({name, {some.begin(), some.end()}});
      room_ -= protocol::wanted_definition_bytes(num_fit);
      pieces = pieces.subspan(num_fit);
    } while (!pieces.empty());
    return true;
  }

  std::vector<protocol::DefinitionRequest>& requests() { return requests_; }

 private:
  bool begin() {
    if (requests_.size() == kRequestsPerAskMax) return false;
    requests_.push_back(empty_);
    room_ = room_max_;
    return true;
  }

  protocol::DefinitionRequest empty_;
  std::size_t room_max_;
  std::size_t room_ = 0;
  std::vector<protocol::DefinitionRequest> requests_;
};

}  // namespace

/// Asks for what waiting roll-outs lack, unless all of it was asked for just now, and lets go of
/// those that have waited too long.
void WorkerCore::ask_for_definitions(const Turn& turn, protocol::LearnerId id,
                                     LearnerLink& learner) {
  std::set<DefinitionName> missing;
  for (const RolloutName& name : queue_.of_learner(id)) {
    const HeldRollout& held = *queue_.find(name);
    if (held.state != RolloutState::kWaiting) continue;
    const DefinitionName task{DefinitionKind::kTask, held.request.task_id};
    const DefinitionName policy{DefinitionKind::kPolicy, held.request.policy_id};
    const bool lacks_task = definitions_.find(task) == nullptr;
    const bool lacks_policy = definitions_.find(policy) == nullptr;
    if (!lacks_task && !lacks_policy && !held.lacks_theta()) continue;
    if (turn.now >= held.since + settings_.definition_wait_max) {
      turn.warn("roll-outs let go",
                fmt::format("lets roll-out {} of run {} go: its {} did not come in {:.0f} s",
                            name.key.number, name.key.run,
                            lacks_task     ? "task"
                            : lacks_policy ? "policy"
                                           : "theta",
                            to_seconds(settings_.definition_wait_max)));
      queue_.remove(name);
      continue;
    }
    if (lacks_task) missing.insert(task);
    if (lacks_policy) missing.insert(policy);
    if (held.lacks_theta()) missing.insert({DefinitionKind::kTheta, *held.request.theta_id});
  }
  if (!learner.ask(turn.now, missing)) return;
  RequestWriter writer({.worker_id = settings_.worker_id, .learner_id = id, .definitions = {}},
                       settings_.batch_bytes_max);
  for (const DefinitionName& name : missing) {
    if (!writer.add(name, definitions_.missing_pieces(id, name))) break;
  }
  for (protocol::DefinitionRequest& request : writer.requests()) {
    turn.effects.emplace_back(SendMessage{std::move(request)});
  }
}

/// Pieces of thetas come for every worker's roll-outs: what none here waits for is not kept.
void WorkerCore::take_theta(const Turn& turn, const protocol::DefinitionPiece& piece) {
  const auto names = queue_.without_theta(piece.learner_id, piece.name.id);
  if (names.empty()) return;
  const std::optional<std::string> content = definitions_.assemble(turn, piece, queue_);
  if (!content) return;
  const auto theta = protocol::theta_of_content(*content);
  if (!theta) {
    ++num_rejected_;
    turn.warn("definitions refused",
              fmt::format("a theta of learner {} is not 1 to {} finite numbers", piece.learner_id,
                          protocol::kThetaDimMax));
  }
  for (const RolloutName& name : names) {
    if (!theta) {
      queue_.remove(name);
      continue;
    }
    queue_.set_theta(name, *theta);
    review(name);
  }
}

/// Whether an evaluator is at work on what no roll-out waited for.
bool WorkerCore::checks_another() const {
  const Definition* other = other_check_ ? definitions_.find(*other_check_) : nullptr;
  return other != nullptr && other->state == DefinitionState::kChecking;
}

/// It may have ended in any way: accepted, refused, or with its evaluator.
void WorkerCore::note_check(TimePoint now) {
  if (other_check_ && !other_check_ended_ && !checks_another()) other_check_ended_ = now;
}

/// What a roll-out waits for is checked at once. The rest, which anybody may have sent and which
/// may take long, has one evaluator; while roll-outs are ready, a fifth of its time.
std::optional<DefinitionName> WorkerCore::next_check(TimePoint now) {
  if (!definitions_.has_unchecked()) return std::nullopt;
  std::set<DefinitionName> wanted;
  for (const DefinitionKind kind : {DefinitionKind::kTask, DefinitionKind::kPolicy}) {
    for (const ContentHash& id : queue_.definitions(kind)) wanted.insert({kind, id});
  }
  if (const auto name = definitions_.take_unchecked(&wanted)) return name;
  constexpr int kPauseOfChecks = 4;  // times as long as they take
  if (checks_another()) return std::nullopt;
  if (queue_.any_ready() && other_check_ended_) {
    const Duration pause = kPauseOfChecks * (*other_check_ended_ - other_check_began_);
    if (now < *other_check_ended_ + pause) return std::nullopt;
  }
  other_check_ = definitions_.take_unchecked();
  other_check_began_ = now;
  other_check_ended_.reset();
  return other_check_;
}

}  // namespace treeroll::worker
