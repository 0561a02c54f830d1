#include "tests/simulation/simulated_relay.h"

#include <variant>

#include "common/protocol/wire_sizes.h"
#include "tests/simulation/gate.h"

namespace treeroll::simulation {
namespace {

constexpr std::uint32_t kRelayProcessDice = 50;
constexpr int kRelayBufferBytes = 4 << 20;

relay::RelaySettings relay_settings(const Scenario& scenario, Dice& dice, int index) {
  relay::RelaySettings settings;
  settings.relay_id = Gate::name_of(scenario.has_keys, kHostOfRelays + index, dice.id());
  settings.host = "relay" + std::to_string(index);
  settings.pid = 1000 + index;
  settings.version = "simulated";
  settings.batch_bytes_above = scenario.batch_bytes_max;
  settings.batch_bytes_below = scenario.batch_bytes_max;
  settings.word_bytes_below = scenario.has_keys ? protocol::kWordMacBytes : 0;
  return settings;
}

}  // namespace

SimulatedRelay::SimulatedRelay(const Scenario& scenario, Schedule& schedule, Observer& observer,
                               int index, int generation, Surroundings surroundings)
    : Node(schedule, scenario.reading_delay),
      scenario_(scenario),
      observer_(observer),
      surroundings_(std::move(surroundings)),
      dice_(scenario.seed, kRelayProcessDice + static_cast<std::uint32_t>(index),
            static_cast<std::uint32_t>(generation)),
      settings_(relay_settings(scenario, dice_, index)),
      core_(settings_) {}

void SimulatedRelay::drain() {
  if (draining_) return;
  draining_ = true;
  later(Duration{}, [this] { step(relay::DrainRequested{}); });
}

void SimulatedRelay::on_inbox(std::vector<MessagePointer> messages) {
  for (const MessagePointer& message : messages) {
    const bool is_from_above = std::holds_alternative<protocol::RolloutBatch>(*message) ||
                               std::holds_alternative<protocol::DefinitionPiece>(*message) ||
                               std::holds_alternative<protocol::LearnerStatus>(*message);
    if (is_from_above) {
      take(relay::MessageFromAbove{*message});
    } else {
      take(relay::MessageFromBelow{*message});
    }
  }
  step(relay::InboxDrained{});
}

void SimulatedRelay::step(const relay::Event& event) {
  take(event);
  const TimePoint deadline = core_.next_deadline();
  if (deadline != TimePoint::max()) wake_at(deadline);
}

void SimulatedRelay::take(const relay::Event& event) {
  relay::Effects effects;
  core_.step(schedule_.now(), event, effects);
  for (const relay::Effect& effect : effects) {
    std::visit([this](const auto& what) { perform(what); }, effect);
  }
}

void SimulatedRelay::perform(const relay::SendAbove& effect) {
  protocol::Message message = effect.message;
  if (auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    status->receive_buffer_bytes = kRelayBufferBytes;
    check_class(*status);
  } else if (const auto* batch = std::get_if<protocol::RewardBatch>(&message)) {
    note_answers(*batch);
  }
  surroundings_.send_above(std::make_shared<const protocol::Message>(std::move(message)));
}

void SimulatedRelay::check_class(const protocol::WorkerStatus& status) {
  observer_.require(status.numeric_class == "class", "a relay says that it is of another class");
  observer_.require(status.num_evaluators > 0 || status.free_slots == 0,
                    "a relay without workers says it has room");
}

/// As those of a worker.
void SimulatedRelay::note_answers(const protocol::RewardBatch& batch) {
  auto& answers = observer_.answers[{settings_.relay_id, batch.learner_id}];
  for (std::size_t i = 0; i < batch.results.size(); ++i) {
    const Observer::Question question(batch.results[i].key, batch.results[i].content);
    const std::int64_t index = batch.first_index + static_cast<std::int64_t>(i);
    const auto [place, is_new] = answers.emplace(index, question);
    observer_.require(is_new || place->second == question,
                      "a relay gives one index to two answers");
  }
  observer_.require(
      batch.oldest_index <= observer_.settled[{settings_.relay_id, batch.learner_id}] + 1,
      "a relay drops an answer that is not settled");
}

void SimulatedRelay::perform(const relay::SendBelow& effect) {
  if (const auto* batch = std::get_if<protocol::RolloutBatch>(&effect.message)) {
    for (const protocol::Acknowledgement& acknowledgement : batch->acknowledgements) {
      std::int64_t& settled = observer_.settled[{acknowledgement.worker_id, batch->learner_id}];
      settled = std::max(settled, acknowledgement.result_index);
    }
    observer_.count("roll-outs through relays", std::ssize(batch->rollouts));
  }
  surroundings_.send_below(std::make_shared<const protocol::Message>(effect.message));
}

void SimulatedRelay::perform(const relay::Exit& effect) {
  observer_.require(draining_ && effect.status == 0, "a relay leaves without being asked");
  surroundings_.exited();
}

}  // namespace treeroll::simulation
