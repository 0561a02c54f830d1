#include "learner/app/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <random>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/files/atomic_file.h"
#include "common/files/whole_file.h"
#include "common/program/program.h"
#include "common/program/standard_output.h"
#include "common/protocol/timings.h"
#include "common/transport/bus.h"
#include "common/transport/loop.h"
#include "learner/app/local_worker.h"
#include "learner/app/progress_line.h"
#include "learner/core/carry_out.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"
#include "learner/journal/journal_fold.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/study/study_file.h"
#include "learner/worker_program/task_survey.h"

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

std::int64_t wall_time_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

/// Drives the core: turns what the loop sees into events and carries its effects out.
class LearnerDaemon : private learner::EffectHandler {
 public:
  LearnerDaemon(Study study, learner::LearnerSettings settings, const LearnerOptions& options)
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
    core_ = std::make_unique<learner::LearnerCore>(std::move(study), settings_);
  }

  /// Takes the journal for this learner alone.
  void lock_journal(const fs::path& path) { journal_.emplace(path); }

  /// Folds what the journal holds, and begins to write.
  void continue_journal(const fs::path& path, const ContentHash& study_id) {
    const JournalTail tail = fold_journal(path, study_id, loop_.now(), *core_);
    if (tail.torn_bytes > 0) {
      spdlog::warn("{}: cut off {} bytes that an interrupted learner left", path.string(),
                   tail.torn_bytes);
    }
    journal_->continue_after(tail);
    journal_->append(JournalStart{kAlgorithmVersion, study_id, settings_.learner_id},
                     wall_time_us());
    journal_->sync();
  }

  void run() {
    if (core_->outcome() != learner::LearnerCore::Outcome::kRunning) return finish();
    loop_.on_signals({SIGINT, SIGTERM}, [this](int signal) { stop(signal); });
    if (options_.local_workers > 0) {
      loop_.on_signals({SIGCHLD}, [this](int) {
        if (local_worker_) watch_local_worker();
      });
      local_worker_.emplace(options_, loop_.now());
    }
    step(learner::RecoveryFinished{});
    loop_.run();
    if (failure_) std::rethrow_exception(failure_);
    if (core_->outcome() == learner::LearnerCore::Outcome::kFailed) {
      throw ConfigError("task", "", core_->failure());
    }
    finish();
  }

  /// A clean end, once the results are written.
  void seal_journal() {
    journal_->append(JournalSeal{}, wall_time_us());
    journal_->sync();
  }

  const learner::LearnerCore& core() const { return *core_; }

 private:
  void stop(int signal) {
    if (is_stopping_) return loop_.stop();
    spdlog::warn("{}: waits for the roll-outs under way; once more ends at once",
                 strsignal(signal));
    is_stopping_ = true;
    step(learner::StopRequested{});
  }

  void receive(const protocol::Message& message) {
    step(learner::MessageReceived{message});
    if (answer_is_due_) return;
    answer_is_due_ = true;
    loop_.after_ready_events([this] {
      answer_is_due_ = false;
      step(learner::InboxDrained{});
    });
  }

  void watch_local_worker() {
    local_worker_->watch(loop_.now());
    restart_timer_.set(local_worker_->next_start());
  }

  void sync() {
    sync_timer_.set(TimePoint::max());
    try {
      journal_->sync();
    } catch (const std::runtime_error&) {
      return fail();
    }
    step(learner::JournalSynced{});
  }

  void step(const learner::Event& event) {
    if (failure_) return;
    learner::Effects effects;
    core_->step(loop_.now(), event, effects);
    try {
      learner::carry_out(effects, *this);
    } catch (const std::runtime_error&) {
      return fail();
    }
    if (core_->outcome() != learner::LearnerCore::Outcome::kRunning) return loop_.stop();
    core_timer_.set(core_->next_deadline());
  }

  void append(const AcceptedResult& result) override { journal_->append(result, wall_time_us()); }

  void append(const LearningTime& time) override { journal_->append(time, wall_time_us()); }

  void flush() override {
    journal_->flush();
    if (!sync_timer_.is_set()) sync_timer_.set(loop_.now() + protocol::kSyncPeriod);
  }

  void send(const protocol::Message& message) override {
    bus_->publish(message);
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
      progress_.show(*status, loop_.now());
      progress_.show(bus_->statistics(), loop_.now());
    }
  }

  void log(const LogLine& line) override {
    switch (line.level) {
      case LogLine::Level::kInfo:
        return spdlog::info("{}", line.text);
      case LogLine::Level::kWarning:
        return spdlog::warn("{}", line.text);
      case LogLine::Level::kError:
        return spdlog::error("{}", line.text);
    }
  }

  /// A learner that cannot write must not go on; called inside a catch.
  void fail() {
    failure_ = std::current_exception();
    loop_.stop();
  }

  void finish() {
    sync();  // and the last acknowledgements
    if (failure_) std::rethrow_exception(failure_);
  }

  transport::Loop loop_;
  transport::Timer core_timer_{loop_, [this] { step(learner::TimerFired{}); }};
  transport::Timer sync_timer_{loop_, [this] { sync(); }};
  transport::Timer restart_timer_{loop_, [this] { watch_local_worker(); }};
  learner::LearnerSettings settings_;
  const LearnerOptions& options_;
  std::unique_ptr<transport::Bus> bus_;
  std::unique_ptr<learner::LearnerCore> core_;
  std::optional<JournalWriter> journal_;
  std::optional<LocalWorker> local_worker_;
  ProgressLine progress_;
  bool answer_is_due_ = false;
  bool is_stopping_ = false;
  std::exception_ptr failure_;
};

/// How well each model that was fitted describes its demonstration; conditions share models.
void log_fits(const LoadedStudy& loaded) {
  std::set<std::vector<double>> said;
  for (std::size_t i = 0; i < loaded.log_likelihoods.size(); ++i) {
    const std::vector<double>& by_layer = loaded.log_likelihoods[i];
    if (by_layer.empty() || !said.insert(by_layer).second) continue;
    spdlog::info("{}: log-likelihood per sample of the demonstration, layer by layer: {:.4f}",
                 loaded.study.conditions[i].name, fmt::join(by_layer, ", "));
  }
}

void salvage(const fs::path& journal) {
  const Salvaged kept = salvage_journal(journal);
  if (kept.damage.empty()) {
    return spdlog::info("{}: nothing to salvage, it is whole", journal.string());
  }
  spdlog::warn("{}", kept.damage);
  spdlog::warn(
      "kept {} records ({} bytes) before the damage, left {} bytes; the journal as it was: {}",
      kept.num_records, kept.bytes_kept, kept.bytes_lost, kept.whole.string());
}

}  // namespace

int run_learner(const LearnerOptions& options) {
  const bool resumes = !options.resume_dir.empty();
  if (resumes) check_resumable(options.resume_dir);
  const LoadedStudy loaded =
      load_study(resumes ? study_of(options.resume_dir) : options.study_file, options.overrides);
  learner::LearnerSettings settings;
  settings.learner_id = draw_learner_id();
  settings.known_tasks = survey_tasks(loaded, options.worker_program, options.needs_worker_program);
  fs::path directory = resumes ? options.resume_dir : options.state_dir;
  if (directory.empty()) directory = fs::path("treeroll-runs") / loaded.study.name;
  if (!resumes) check_state_directory(directory);

  LearnerDaemon daemon(loaded.study, settings, options);
  make_directories_durably(directory);
  daemon.lock_journal(journal_of(directory));
  if (!resumes) {
    check_state_directory(directory);  // again: another learner may have been faster to the lock
    write_atomically(study_of(directory), loaded.resolved_toml);  // and the journal's name lasts
  }
  if (options.salvage) salvage(journal_of(directory));
  daemon.continue_journal(journal_of(directory),
                          content_hash(read_whole_file(study_of(directory))));
  spdlog::info("learner {:x}, study {}: {} conditions x {} repetitions, {} {}", settings.learner_id,
               loaded.study.name, loaded.study.conditions.size(), loaded.study.repetitions,
               resumes ? "goes on in" : "results go to", directory.string());
  log_fits(loaded);
  if (resumes) {
    spdlog::info("{} roll-outs are in the journal", daemon.core().counters().applied);
  }

  const auto start = std::chrono::steady_clock::now();
  daemon.run();
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<RunRecord> runs = daemon.core().run_records();
  const StudySummary summary{loaded.study.name, summarize(runs, daemon.core().noisy_conditions()),
                             daemon.core().counters(), daemon.core().worker_records(), elapsed_s};
  if (const std::string failures = write_results(directory, runs); !failures.empty()) {
    throw std::runtime_error(failures);
  }
  daemon.seal_journal();
  // Last: whoever reads it may have gone, which ends us at once (SIGPIPE).
  fmt::print("{}", options.json ? to_json(summary) + "\n" : to_table(summary.conditions));
  flush_standard_output();
  if (daemon.core().outcome() != learner::LearnerCore::Outcome::kDone) {
    spdlog::warn("stopped early with {} roll-outs; go on with --resume {}", summary.ledger.applied,
                 directory.string());
    return kExitStopped;
  }
  spdlog::info("done in {:.1f} s: {}", elapsed_s, directory.string());
  if (const std::string why = why_nothing_was_learnt(summary.conditions); !why.empty()) {
    spdlog::error("nothing was learnt: {}", why);
    return kExitNothingLearnt;
  }
  return kExitDone;
}

}  // namespace treeroll
