#include "learner/app/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <random>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/transport/bus.h"
#include "common/transport/loop.h"
#include "learner/app/local_worker.h"
#include "learner/app/progress_line.h"
#include "learner/app/state_directory.h"
#include "learner/app/study_file.h"
#include "learner/app/task_survey.h"
#include "learner/core/learner_core.h"
#include "learner/report/summary.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using transport::Channel;

/// A fresh name for this incarnation: answers to an earlier one cannot pass.
protocol::LearnerId draw_learner_id() {
  std::random_device device;
  const std::uint64_t bits = (static_cast<std::uint64_t>(device()) << 32U) | device();
  return static_cast<protocol::LearnerId>(bits >> 1U) | 1;
}

void log(const LogLine& line) {
  switch (line.level) {
    case LogLine::Level::kInfo:
      return spdlog::info("{}", line.text);
    case LogLine::Level::kWarning:
      return spdlog::warn("{}", line.text);
    case LogLine::Level::kError:
      return spdlog::error("{}", line.text);
  }
}

/// Drives the core: turns what the loop sees into events and carries its effects out.
class LearnerDaemon {
 public:
  LearnerDaemon(Study study, LearnerSettings settings, const LearnerOptions& options)
      : settings_(std::move(settings)), options_(options) {
    transport::BusOptions bus;
    bus.url = options.lcm_url;
    bus.channels = {Channel::kRewardBatch, Channel::kWorkerStatus, Channel::kDefinitionRequest,
                    Channel::kDefinitionReport};
    bus.on_message = [this](const protocol::Message& message) { receive(message); };
    Result<std::unique_ptr<transport::Bus>> opened = open_bus(loop_, std::move(bus));
    if (!opened) throw ConfigError("--lcm-url", options.lcm_url, opened.error().message);
    bus_ = std::move(*opened);
    settings_.batch_bytes_max = bus_->batch_bytes_max();
    core_ = std::make_unique<LearnerCore>(std::move(study), settings_);
  }

  /// @return true when the study is done, false when it was stopped
  bool run() {
    loop_.on_signals({SIGINT, SIGTERM}, [this](int signal) {
      spdlog::warn("stopped by {}", strsignal(signal));
      stopped_ = true;
      loop_.stop();
    });
    if (options_.local_workers > 0) {
      local_worker_.emplace(options_);
      loop_.on_signals({SIGCHLD}, [this](int) { local_worker_->on_child_ended(); });
    }
    step(learner_event::Started{});
    loop_.run();
    if (core_->outcome() == LearnerCore::Outcome::kFailed) {
      throw ConfigError("task", "", core_->failure());
    }
    return !stopped_;
  }

  const LearnerCore& core() const { return *core_; }

 private:
  void receive(const protocol::Message& message) {
    step(learner_event::Received{&message});
    if (answer_is_due_) return;
    answer_is_due_ = true;
    loop_.after_ready_events([this] {
      answer_is_due_ = false;
      step(learner_event::InboxDrained{});
    });
  }

  void step(const LearnerEvent& event) {
    const TimePoint now = loop_.now();
    LearnerEffects effects;
    core_->step(now, event, effects);
    for (const protocol::Message& message : effects.send) {
      bus_->publish(message);
      if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
        progress_.show(*status, now);
        progress_.show(bus_->statistics());
      }
    }
    for (const LogLine& line : effects.log) log(line);
    if (core_->outcome() != LearnerCore::Outcome::kRunning) return loop_.stop();
    loop_.set_timer(core_->next_deadline(), [this] { step(learner_event::Timer{}); });
  }

  transport::Loop loop_;
  LearnerSettings settings_;
  const LearnerOptions& options_;
  std::unique_ptr<transport::Bus> bus_;
  std::unique_ptr<LearnerCore> core_;
  std::optional<LocalWorker> local_worker_;
  ProgressLine progress_;
  bool answer_is_due_ = false;
  bool stopped_ = false;
};

}  // namespace

int run_learner(const LearnerOptions& options) {
  const LoadedStudy loaded = load_study(options.study_file, options.overrides);
  const std::map<std::string, TaskFacts> facts = survey_tasks(loaded, options);
  const fs::path directory =
      options.state_dir.empty() ? fs::path("treeroll-runs") / loaded.study.name : options.state_dir;
  check_state_directory(directory);

  LearnerSettings settings;
  settings.learner_id = draw_learner_id();
  settings.known_tasks = facts;
  LearnerDaemon daemon(loaded.study, settings, options);
  make_state_directory(directory, loaded.resolved_toml);
  spdlog::info("learner {:x}, study {}: {} conditions x {} repetitions, results go to {}",
               settings.learner_id, loaded.study.name, loaded.study.conditions.size(),
               loaded.study.repetitions, directory.string());

  const TimePoint start = transport::Loop().now();
  const bool done = daemon.run();
  const double elapsed_s = to_seconds(transport::Loop().now() - start);
  const std::vector<RunRecord> runs = daemon.core().run_records();
  const StudySummary summary{loaded.study.name, summarize(runs), daemon.core().counters(),
                             daemon.core().worker_records(), elapsed_s};
  write_results(directory, runs);
  if (options.json) {
    fmt::print("{}\n", to_json(summary));
  } else {
    fmt::print("{}", to_table(summary.conditions));
  }
  std::fflush(stdout);
  if (!done) {
    spdlog::warn("stopped early: {} roll-outs are in {}", summary.ledger.applied,
                 directory.string());
    return kExitOther;
  }
  spdlog::info("done in {:.1f} s: {}", elapsed_s, directory.string());
  return kExitDone;
}

}  // namespace treeroll
