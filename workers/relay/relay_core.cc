#include "workers/relay/relay_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "common/protocol/timings.h"

namespace treeroll::relay {
namespace {

constexpr Duration kRemindPeriod = std::chrono::seconds(1);

/// A relay holds for many what a worker holds for a few.
constexpr std::size_t kAnswersMax = 8 * protocol::kAnswersMax;
constexpr std::size_t kPoliciesMax = 8 * protocol::kPoliciesMax;
constexpr std::size_t kDefinitionBytesMax = 8 * protocol::kDefinitionCacheBytesMax;
/// Its workers have a roll-out each to go on with, so its answers wait for others to go along.
constexpr double kFewPerEvaluator = 1;

worker::WorkerSettings settings_above(const RelaySettings& relay) {
  worker::WorkerSettings settings;
  settings.worker_id = relay.relay_id;
  settings.host = relay.host;
  settings.pid = relay.pid;
  settings.version = relay.version;
  settings.numeric_class = relay.numeric_class;
  settings.batch_bytes_max = relay.batch_bytes_above;
  settings.num_answers_max = kAnswersMax;
  settings.num_policies_max = kPoliciesMax;
  settings.definition_bytes_max = kDefinitionBytesMax;
  settings.together_max = 1;  // workers below decide
  settings.few_per_evaluator = kFewPerEvaluator;
  return settings;
}

/// Whose message it is, of those that workers send; nothing for others.
std::optional<protocol::WorkerId> sender_of(const protocol::Message& message) {
  return std::visit(
      [](const auto& m) -> std::optional<protocol::WorkerId> {
        if constexpr (requires { m.worker_id; }) return m.worker_id;
        return std::nullopt;
      },
      message);
}

std::optional<protocol::LearnerId> learner_of(const protocol::Message& message) {
  return std::visit(
      [](const auto& m) -> std::optional<protocol::LearnerId> {
        if constexpr (requires { m.learner_id; }) return m.learner_id;
        return std::nullopt;
      },
      message);
}

}  // namespace

RelayCore::RelayCore(RelaySettings settings)
    : settings_(std::move(settings)),
      rack_({.relay_id = settings_.relay_id,
             .batch_bytes_max = settings_.batch_bytes_below,
             .word_bytes = settings_.word_bytes_below}),
      workers_(/*has_keys=*/settings_.word_bytes_below > 0) {}

void RelayCore::step(TimePoint now, const Event& event, Effects& effects) {
  if (exited_) return;
  const Turn turn{now, effects, log_limiter_};
  std::visit([&](const auto& e) { on(turn, e); }, event);
}

TimePoint RelayCore::next_deadline() const {
  if (exited_) return TimePoint::max();
  TimePoint next = remind_at_;
  if (const auto below = rack_.downlink_deadline()) next = std::min(next, *below);
  if (const auto look = workers_.next_look()) next = std::min(next, *look);
  if (above_) next = std::min(next, above_->next_deadline());
  return next;
}

void RelayCore::on(const Turn& turn, const Started&) {
  remind_at_ = turn.now + kRemindPeriod;
  if (!settings_.numeric_class.empty()) choose_class(turn, settings_.numeric_class);
}

void RelayCore::on(const Turn& turn, const MessageFromAbove& event) {
  if (!above_) return;  // nobody is here to work
  if (const auto* status = std::get_if<protocol::LearnerStatus>(&event.message)) {
    rack_.pass_on(turn.now, *status);
  } else if (const auto learner = learner_of(event.message)) {
    rack_.hear(turn.now, *learner);
  }
  step_upwards(turn, worker::MessageReceived{event.message});
}

void RelayCore::on(const Turn& turn, const MessageFromBelow& event) {
  const std::optional<protocol::WorkerId> sender = sender_of(event.message);
  if (!sender) return;
  const auto* status = std::get_if<protocol::WorkerStatus>(&event.message);
  if (status != nullptr ? !take_status(turn, *status) : !is_served(*sender)) return;
  learner::WorkerEntry& worker = *workers_.hear(*sender, turn.now);
  const auto worth = [&] {
    const Standing::Use use = use_of(worker, turn.now);
    return std::pair(use, worker.evaluators_shown());
  };
  const auto worth_before = worth();
  rack_.receive(turn.now, event.message);
  if (worth() != worth_before) counts_again_ = true;
}

void RelayCore::on(const Turn& turn, const InboxDrained&) { settle(turn); }

void RelayCore::on(const Turn& turn, const TimerFired&) {
  if (!workers_.remove_silent(turn.now).empty()) counts_again_ = true;
  rack_.on_timer(turn.now);
  if (turn.now >= remind_at_) {
    remind_at_ = turn.now + kRemindPeriod;
    workers_.note_told(turn.now, static_cast<int>(workers_.all().size()));
    rack_.remind(turn.now);
    count_evaluators(turn);
    turn.log_due();
  }
  if (above_ && turn.now >= above_->next_deadline()) step_upwards(turn, worker::TimerFired{});
  settle(turn);
}

void RelayCore::on(const Turn& turn, const DrainRequested&) {
  if (above_) {
    step_upwards(turn, worker::DrainRequested{});
    return settle(turn);
  }
  turn.effects.emplace_back(Exit{0});
  exited_ = true;
}

/// Whether it is one of those that are served: the others are of another class.
bool RelayCore::take_status(const Turn& turn, const protocol::WorkerStatus& status) {
  const bool is_known = workers_.find(status.worker_id) != nullptr;
  learner::WorkerEntry* worker = workers_.hear(status.worker_id, turn.now);
  if (!workers_.take_put_out().empty()) counts_again_ = true;
  if (worker == nullptr) {
    turn.warn("workers refused",
              fmt::format("worker {} is refused: {} workers are the most that are served, {} of "
                          "one key",
                          status.worker_id, protocol::kWorkersMax, protocol::kWorkersOfOneKeyMax));
    return false;
  }
  if (!above_ && !status.numeric_class.empty()) choose_class(turn, status.numeric_class);
  const bool had_evaluators = worker->num_evaluators > 0 && !worker->draining;
  worker->host = status.host;
  worker->pid = status.pid;
  worker->num_evaluators = status.num_evaluators;
  worker->draining = status.draining;
  worker->numeric_class = status.numeric_class;
  const bool was_other = std::exchange(worker->other_class,
                                       !above_ || status.numeric_class != settings_.numeric_class);
  if (worker->other_class && !(is_known && was_other)) {
    turn.warn("workers of another class",
              fmt::format("{} gets no roll-outs: it is of numeric class {}, this relay serves {}; "
                          "another relay may serve it (--numeric-class)",
                          describe(*worker),
                          status.numeric_class.empty() ? "unknown" : status.numeric_class,
                          settings_.numeric_class));
  }
  const bool has_evaluators = worker->num_evaluators > 0 && !worker->draining;
  if (!is_known || had_evaluators != has_evaluators || was_other != worker->other_class) {
    counts_again_ = true;
  }
  return !worker->other_class;
}

bool RelayCore::is_served(protocol::WorkerId worker) const {
  const auto found = workers_.all().find(worker);
  return found != workers_.all().end() && !found->second.other_class;
}

/// For good: answers that wait to be sent are of this class.
void RelayCore::choose_class(const Turn& turn, const std::string& numeric_class) {
  settings_.numeric_class = numeric_class;
  turn.inform("class served", fmt::format("serves workers of numeric class {}", numeric_class));
  above_.emplace(settings_above(settings_), rack_);
  step_upwards(turn, worker::Started{});
}

/// To the learners that are served, whose work shows what a worker is: that is kept here too.
Standing::Use RelayCore::use_of(learner::WorkerEntry& worker, TimePoint now) const {
  const std::optional<Standing> standing = rack_.standing_of(worker.id, now);
  if (!standing) return Standing::Use::kPerhaps;
  worker.joined |= standing->has_answered_a_greeting;
  worker.num_accepted = std::max(worker.num_accepted, standing->num_accepted);
  return standing->use;
}

/// Those of workers that hear, as many as each has shown that it has: a learner believes a relay of
/// its workers what it would not believe them. While none hears yet, those of which it may be.
void RelayCore::count_evaluators(const Turn& turn) {
  counts_again_ = false;
  int count_now = 0;
  int count_perhaps = 0;
  bool has_any = false;
  for (auto& [id, worker] : workers_.all()) {
    if (worker.other_class || worker.draining) continue;
    has_any = has_any || worker.num_evaluators > 0;
    const Standing::Use use = use_of(worker, turn.now);
    if (use == Standing::Use::kNow) count_now += worker.evaluators_shown();
    if (use == Standing::Use::kPerhaps) count_perhaps += worker.evaluators_shown();
  }
  if (has_any && count_now + count_perhaps == 0) {
    turn.warn("workers of no use",
              "no worker can be given roll-outs: each is distrusted or does not hear");
  }
  rack_.set_count(
      std::min(count_now > 0 ? count_now : count_perhaps, protocol::kEvaluatorsPerWorkerMax));
}

void RelayCore::step_upwards(const Turn& turn, const worker::Event& event) {
  worker::Effects effects;
  above_->step(turn.now, event, effects);
  for (worker::Effect& effect : effects) {
    if (auto* send = std::get_if<worker::SendMessage>(&effect)) {
      turn.effects.emplace_back(SendAbove{std::move(send->message)});
    } else if (auto* line = std::get_if<LogLine>(&effect)) {
      turn.effects.emplace_back(std::move(*line));
    } else if (const auto* exit = std::get_if<worker::Exit>(&effect)) {
      exited_ = true;
      turn.effects.emplace_back(Exit{exit->status});
    }
  }
}

/// What has come from below goes up, what from above down. The journal's part is played by the
/// answers that are kept until they are settled above.
void RelayCore::settle(const Turn& turn) {
  if (counts_again_) count_evaluators(turn);
  // A verdict may set roll-outs free, and a roll-out given down be refused at once. The event is
  // the one after which a worker gives up all that it holds, if none of its evaluators is left.
  while (above_ && rack_.has_news() && !exited_) step_upwards(turn, worker::EvaluatorDied{});
  if (above_ && !exited_) step_upwards(turn, worker::InboxDrained{});
  rack_.dispatch(turn.now);
  for (learner::Effect& effect : rack_.take_effects()) {
    if (auto* send = std::get_if<learner::SendMessage>(&effect)) {
      turn.effects.emplace_back(SendBelow{std::move(send->message)});
    } else if (auto* line = std::get_if<LogLine>(&effect)) {
      turn.effects.emplace_back(std::move(*line));
    }
  }
}

}  // namespace treeroll::relay
