#include "workers/app/worker_daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <thread>
#include <utility>
#include <variant>

#include "common/program/process_start.h"
#include "workers/app/definition_facts.h"
#include "workers/app/packet.h"

namespace treeroll::worker {
namespace {

Death cause_of(const ChildEnd& end) {
  if (end.exited) return Death::kExited;
  // These others send: a person, a service manager, a kernel short of memory. By any other a
  // program ends itself, by an alarm it has set or a pipe it writes to, say: again each time, were
  // it no answer.
  for (const int of_others : {SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT}) {
    if (end.code == of_others) return Death::kForeignSignal;
  }
  return Death::kFatalSignal;
}

}  // namespace

Result<std::unique_ptr<WorkerDaemon>> WorkerDaemon::open(const std::string& url,
                                                         std::optional<transport::KeyFile> key_file,
                                                         WorkerSettings settings,
                                                         EvaluatorSettings evaluators) {
  std::unique_ptr<WorkerDaemon> daemon(new WorkerDaemon);
  daemon->evaluators_ = std::move(evaluators);
  using transport::Channel;
  transport::BusOptions options;
  options.url = url;
  options.channels = {Channel::kRolloutBatch, Channel::kDefinitionPiece, Channel::kLearnerStatus};
  options.among_programs = true;
  options.key_file = std::move(key_file);
  options.on_message = [self = daemon.get()](protocol::Message message) {
    if (self->core_) self->post(MessageReceived{std::move(message)});
  };
  auto bus = transport::open_bus(daemon->loop_, std::move(options));
  if (!bus) return bus.error();
  daemon->bus_ = *std::move(bus);
  settings.batch_bytes_max = daemon->bus_->batch_bytes_max();
  daemon->slots_.resize(static_cast<std::size_t>(settings.num_evaluators));
  daemon->core_.emplace(std::move(settings));
  return daemon;
}

/// All have their grace together. Who is left is killed with its slot.
WorkerDaemon::~WorkerDaemon() {
  for (Slot& slot : slots_) {
    unwatch(slot);
    if (slot.process) slot.process->end();
  }
  const auto works = [](const Slot& slot) { return slot.process && !slot.process->has_ended(); };
  const TimePoint deadline = loop_.now() + kEvaluatorEndGrace;
  while (std::ranges::any_of(slots_, works) && loop_.now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (const Slot& slot : slots_) {
    if (slot.process) slot.process->kill();  // all first, then each is waited for
  }
}

int WorkerDaemon::run() {
  loop_.on_signals(stop_signals(), [this](int) {
    manager_.say_stopping();
    post(DrainRequested{});
  });
  loop_.on_signals({SIGCHLD}, [this](int) { collect_ended(); });
  post(Started{});
  manager_.say_ready();
  if (!exit_status_) loop_.run();
  return *exit_status_;
}

/// Effects may bring events of their own, which are taken after the effects before them.
void WorkerDaemon::post(Event event) {
  events_.push_back(std::move(event));
  if (working_) return;
  working_ = true;
  while (!events_.empty() && !exit_status_) {
    Event next = std::move(events_.front());
    events_.pop_front();
    Effects effects;
    core_->step(loop_.now(), std::move(next), effects);
    for (Effect& effect : effects) {
      std::visit([this](auto& e) { perform(e); }, effect);
    }
  }
  working_ = false;
  schedule_flush();
}

void WorkerDaemon::schedule_flush() {
  if (flush_scheduled_ || exit_status_) return;
  flush_scheduled_ = true;
  loop_.after_ready_events([this] { flush(); });
}

void WorkerDaemon::flush() {
  post(InboxDrained{});
  flush_scheduled_ = false;
  if (exit_status_) return;
  timer_.set(core_->next_deadline());
}

void WorkerDaemon::perform(SendMessage& effect) {
  if (auto* status = std::get_if<protocol::WorkerStatus>(&effect.message)) {
    const transport::BusStatistics statistics = bus_->statistics();
    status->receive_buffer_bytes = statistics.receive_buffer_bytes;
    status->num_rejected += statistics.num_rejected;
    for (const std::string& line : bus_trouble_.news(statistics)) spdlog::warn("{}", line);
    log_.tell_due(loop_.now());
  }
  bus_->publish(effect.message);
}

void WorkerDaemon::perform(const StartEvaluator& effect) {
  Slot& slot = slot_of(effect.evaluator);
  Result<EvaluatorProcess> process = EvaluatorProcess::start(evaluators_);
  if (!process) {
    complain("evaluators that cannot be started", process.error().message);
    post(EvaluatorDied{effect.evaluator, Death::kExited, 1});
    return;
  }
  slot.process.emplace(*std::move(process));
  slot.loading.reset();
  slot.watched = true;
  loop_.watch(slot.process->socket(), [this, index = effect.evaluator] { read_one(index); });
}

void WorkerDaemon::perform(const EndEvaluator& effect) {
  const Slot& slot = slot_of(effect.evaluator);
  if (slot.process) slot.process->end();
}

void WorkerDaemon::perform(const KillEvaluator& effect) {
  const Slot& slot = slot_of(effect.evaluator);
  if (slot.process) slot.process->kill();
}

/// Never waits: an evaluator reads whatever it is given before it is given more. One that does
/// not is not working.
void WorkerDaemon::give(int evaluator, const auto& packet) {
  const Slot& slot = slot_of(evaluator);
  if (!slot.process) return;
  const SendOutcome outcome = send_packet(slot.process->socket(), packet, false);
  if (outcome == SendOutcome::kSent) return;
  if (outcome == SendOutcome::kFull) {
    complain("evaluators that do not read", fmt::format("evaluator {} does not read", evaluator));
  }
  slot.process->kill();
}

void WorkerDaemon::perform(const LoadDefinition& effect) {
  Slot& slot = slot_of(effect.evaluator);
  if (!slot.process) return;
  slot.loading = effect.name;
  slot.process->restart_cpu_time();
  give(effect.evaluator, DefinitionContent{effect.name, effect.content});
}

void WorkerDaemon::perform(const ForgetDefinition& effect) {
  give(effect.evaluator, DefinitionContent{effect.name, ""});
}

void WorkerDaemon::perform(RunRollouts& effect) {
  Slot& slot = slot_of(effect.evaluator);
  if (!slot.process) return;
  slot.process->restart_cpu_time();
  protocol::RolloutBatch batch;
  batch.sequence = effect.job;
  batch.rollouts = std::move(effect.requests);
  give(effect.evaluator, protocol::Message(std::move(batch)));
}

void WorkerDaemon::perform(const AskCpuTime& effect) {
  const Slot& slot = slot_of(effect.evaluator);
  if (!slot.process) return;
  post(CpuTimeMeasured{effect.evaluator, effect.job, slot.process->cpu_time()});
}

void WorkerDaemon::perform(const LogLine& line) { log_line(line); }

void WorkerDaemon::perform(const Exit& effect) {
  exit_status_ = effect.status;
  loop_.stop();
}

/// A packet, if there is one; the loop reports the next. @return whether there was one
bool WorkerDaemon::read_one(int evaluator) {
  Slot& slot = slot_of(evaluator);
  if (!slot.process) return false;
  const Received received = receive_packet(slot.process->socket(), false);
  if (received.message) {
    understand(evaluator, *received.message);
    return true;
  }
  const bool malformed = received.malformed || received.definition;
  if (received.closed || malformed) {
    if (malformed) {
      complain("evaluators that send nonsense",
               fmt::format("evaluator {} sends what is no message", evaluator));
    }
    unwatch(slot);
    slot.process->kill();  // whether it is ending already or only closed its socket
  }
  return false;
}

void WorkerDaemon::understand(int evaluator, const protocol::Message& message) {
  Slot& slot = slot_of(evaluator);
  if (std::holds_alternative<protocol::WorkerStatus>(message)) {
    post(EvaluatorReady{evaluator});
  } else if (const auto* report = std::get_if<protocol::DefinitionReport>(&message)) {
    if (!slot.loading || slot.loading->id != report->definition_id) return;
    DefinitionLoaded loaded{evaluator, *slot.loading, report->accepted, report->text, {}};
    slot.loading.reset();
    if (loaded.accepted) {
      const auto facts = read_facts(loaded.name.kind, report->text);
      loaded.accepted = facts.has_value();
      if (facts) loaded.facts = *facts;
      if (!facts) loaded.text = "its description is not complete: " + report->text;
    }
    post(loaded);
  } else if (const auto* answer = std::get_if<protocol::RewardBatch>(&message)) {
    std::int64_t job = answer->last_batch;
    for (const protocol::RolloutResult& result : answer->results) {
      post(RolloutEvaluated{evaluator, job++, result.outcome, result.duration_ns});
    }
  }
}

void WorkerDaemon::unwatch(Slot& slot) {
  if (slot.watched) loop_.forget(slot.process->socket());
  slot.watched = false;
}

/// Signals merge, so every evaluator is looked at; only our own are waited for.
void WorkerDaemon::collect_ended() {
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    Slot& slot = slots_[i];
    if (!slot.process) continue;
    const std::optional<ChildEnd> end = slot.process->collect();
    if (!end) continue;
    while (read_one(static_cast<int>(i))) {  // what it had still sent
    }
    unwatch(slot);
    slot.process.reset();
    post(EvaluatorDied{static_cast<int>(i), cause_of(*end), end->code});
  }
}

void WorkerDaemon::complain(std::string_view kind, std::string text) {
  log_.add(loop_.now(), LogLine::Level::kError, kind, std::move(text));
}

}  // namespace treeroll::worker
