#include "workers/relay/app/relay_daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>
#include <variant>

#include "common/base/config_error.h"
#include "common/program/process_start.h"
#include "common/transport/lcm_url.h"

namespace treeroll::relay {
namespace {

using transport::Channel;

/// Whether these are one group or one server: a relay would hear itself there.
bool are_one(const std::string& above, const std::string& below) {
  const Result<transport::LcmUrl> a = transport::parse_lcm_url(above);
  const Result<transport::LcmUrl> b = transport::parse_lcm_url(below);
  return a && b && a->provider == b->provider && a->host == b->host && a->port == b->port;
}

}  // namespace

Result<std::unique_ptr<RelayDaemon>> RelayDaemon::open(const std::string& url_above,
                                                       const std::string& url_below,
                                                       RelaySettings settings, RelayKeys keys) {
  if (are_one(url_above, url_below)) {
    throw ConfigError("--below", url_below,
                      fmt::format("must be another group or server than --above, {}: the relay "
                                  "would hear itself",
                                  url_above));
  }
  std::unique_ptr<RelayDaemon> daemon(new RelayDaemon);
  RelayDaemon* self = daemon.get();

  transport::BusOptions options;
  options.url = url_above;
  options.channels = {Channel::kRolloutBatch, Channel::kDefinitionPiece, Channel::kLearnerStatus};
  options.among_programs = true;
  options.key_file = std::move(keys.above);
  options.on_message = [self](const protocol::Message& message) {
    self->receive(MessageFromAbove{message});
  };
  auto above = transport::open_bus(self->loop_, options);
  if (!above) return Error{"--above: " + above.error().message};
  self->above_ = *std::move(above);

  options.url = url_below;
  options.key_file = std::move(keys.below);
  options.channels = {Channel::kRewardBatch, Channel::kWorkerStatus, Channel::kDefinitionRequest,
                      Channel::kDefinitionReport};
  options.on_message = [self](const protocol::Message& message) {
    self->receive(MessageFromBelow{message});
  };
  auto below = transport::open_bus(self->loop_, std::move(options));
  if (!below) return Error{"--below: " + below.error().message};
  self->below_ = *std::move(below);

  settings.batch_bytes_above = self->above_->batch_bytes_max();
  settings.batch_bytes_below = self->below_->batch_bytes_max();
  settings.word_bytes_below = self->below_->word_bytes();
  self->core_.emplace(std::move(settings));
  return daemon;
}

int RelayDaemon::run() {
  loop_.on_signals(stop_signals(), [this](int) {
    manager_.say_stopping();
    step(DrainRequested{});
  });
  step(Started{});
  manager_.say_ready();
  if (!exit_status_) loop_.run();
  return *exit_status_;
}

void RelayDaemon::step(const Event& event) {
  if (exit_status_) return;
  Effects effects;
  core_->step(loop_.now(), event, effects);
  for (const Effect& effect : effects) {
    std::visit([this](const auto& what) { perform(what); }, effect);
  }
  timer_.set(core_->next_deadline());
}

void RelayDaemon::receive(const Event& event) {
  if (!core_) return;
  step(event);
  if (std::exchange(drain_is_due_, true)) return;
  loop_.after_ready_events([this] {
    drain_is_due_ = false;
    step(InboxDrained{});
  });
}

void RelayDaemon::perform(const SendAbove& effect) {
  protocol::Message message = effect.message;
  if (auto* status = std::get_if<protocol::WorkerStatus>(&message)) {
    const transport::BusStatistics above = above_->statistics();
    const transport::BusStatistics below = below_->statistics();
    status->receive_buffer_bytes = above.receive_buffer_bytes;
    status->num_rejected += above.num_rejected + below.num_rejected;
    for (const std::string& line : trouble_above_.news(above)) spdlog::warn("above: {}", line);
    for (const std::string& line : trouble_below_.news(below)) spdlog::warn("below: {}", line);
  }
  above_->publish(message);
}

void RelayDaemon::perform(const Exit& effect) {
  exit_status_ = effect.status;
  loop_.stop();
}

}  // namespace treeroll::relay
