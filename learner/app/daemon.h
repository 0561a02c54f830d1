#pragma once

#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/transport/bus.h"
#include "common/transport/loop.h"
#include "common/transport/service_manager.h"
#include "learner/app/local_worker.h"
#include "learner/app/options.h"
#include "learner/app/progress_line.h"
#include "learner/core/carry_out.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"
#include "learner/journal/journal_fold.h"
#include "learner/state/state_study.h"
#include "learner/study/study_file.h"
#include "learner/web/live_page.h"

namespace treeroll {

/// Drives the core: turns what the loop sees into events and carries its effects out.
class LearnerDaemon : private learner::EffectHandler {
 public:
  /// Opens the bus and, where one is asked for, the page.
  /// @param directory  of the study's state
  /// Throws ConfigError for an LCM URL or a page's address that cannot be had.
  LearnerDaemon(const LoadedStudy& loaded, learner::LearnerSettings settings,
                const LearnerOptions& options, const std::filesystem::path& directory);
  ~LearnerDaemon() override;
  LearnerDaemon(const LearnerDaemon&) = delete;
  LearnerDaemon& operator=(const LearnerDaemon&) = delete;

  /// Folds what the journal holds, and begins to write: of a study that is extended first what it
  /// becomes.
  void continue_journal(std::unique_ptr<JournalWriter> journal, const StateFiles& files,
                        const StateStudy& state);
  /// Until every run is done or a signal ends it. Throws std::runtime_error where the journal
  /// cannot be written, ConfigError where no worker can do the study's task.
  void run();
  /// A clean end, once the results are written.
  void seal_journal();

  const learner::LearnerCore& core() const { return *core_; }
  /// Once it is done.
  std::vector<RunRecord> take_results() { return std::move(*core_).run_records(); }

 private:
  void open_page(const LoadedStudy& loaded, const std::filesystem::path& directory);
  FoldHooks hooks_of_page();
  void begin_journal(const JournalTail& tail, const StateFiles& files, const StateStudy& state);

  void step(const learner::Event& event);
  void receive(protocol::Message message);
  void stop(int signal);
  void watch_local_worker();
  void fail();
  void finish();
  void show_the_end();

  template <class Action>
  void on_disk(const Action& action);
  void begin_sync();
  void end_sync();
  void plan_sync();

  void append(const AcceptedResult& result) override;
  void append(const SecondAnswer& answer) override;
  void append(const KnownWorker& worker) override;
  void append(const TaskSignals& signals) override;
  void append(const LearningTime& time) override;
  void write(const JournalRecord& record);
  void flush() override;
  void send(const protocol::Message& message) override;
  void log(const LogLine& line) override;

  transport::Loop loop_;
  transport::ServiceManager manager_{loop_};
  transport::Timer core_timer_{loop_, [this] { step(learner::TimerFired{}); }};
  transport::Timer sync_timer_{loop_, [this] { begin_sync(); }};
  transport::Timer restart_timer_{loop_, [this] { watch_local_worker(); }};
  learner::LearnerSettings settings_;
  const LearnerOptions& options_;
  std::string trust_;  // who is believed, in words
  std::unique_ptr<transport::Bus> bus_;
  std::unique_ptr<learner::LearnerCore> core_;
  learner::Effects effects_;  // of one step; its memory serves the next
  std::optional<web::LivePage> page_;
  std::unique_ptr<JournalWriter> journal_;
  std::optional<LocalWorker> local_worker_;
  ProgressLine progress_;
  bool answer_is_due_ = false;
  bool is_unsynced_ = false;  // something that no sync has begun with
  bool is_syncing_ = false;
  bool is_stopping_ = false;
  bool has_ended_ = false;
  std::exception_ptr failure_;
};

}  // namespace treeroll
