#include "learner/app/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/cut_text.h"
#include "common/files/atomic_file.h"
#include "common/program/host_name.h"
#include "common/program/log.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "common/program/random_id.h"
#include "common/program/standard_output.h"
#include "common/protocol/timings.h"
#include "common/transport/bus.h"
#include "common/transport/loop.h"
#include "learner/app/local_worker.h"
#include "learner/app/progress_line.h"
#include "learner/app/showing.h"
#include "learner/app/told_record.h"
#include "learner/core/carry_out.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"
#include "learner/journal/journal_fold.h"
#include "learner/journal/journal_origins.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/state/state_study.h"
#include "learner/study/study_file.h"
#include "learner/study/task_table.h"
#include "learner/web/live_page.h"
#include "learner/worker_program/task_survey.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using transport::Channel;

/// Their files take seconds, which is said.
constexpr std::size_t kManyRuns = 300;

constexpr Duration kLastLook = std::chrono::milliseconds(1500);

std::int64_t wall_time_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

/// Does what a full disk, say, may end: everything that was learnt is in the journal then.
template <class Action>
void do_resumably(const fs::path& directory, const Action& action) {
  try {
    action();
  } catch (const BadInput&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(
        fmt::format("{}; what is in the journal is kept, go on with --resume {}", error.what(),
                    directory.string()));
  }
}

/// Drives the core: turns what the loop sees into events and carries its effects out.
class LearnerDaemon : private learner::EffectHandler {
 public:
  /// @param directory  of the study's state
  LearnerDaemon(const LoadedStudy& loaded, learner::LearnerSettings settings,
                const LearnerOptions& options, const fs::path& directory)
      : settings_(std::move(settings)), options_(options) {
    transport::BusOptions bus;
    bus.url = options.lcm_url;
    bus.channels = {Channel::kRewardBatch, Channel::kWorkerStatus, Channel::kDefinitionRequest,
                    Channel::kDefinitionReport};
    bus.among_programs = true;
    bus.on_message = [this](protocol::Message message) { receive(std::move(message)); };
    Result<std::unique_ptr<transport::Bus>> opened = open_bus(loop_, std::move(bus));
    if (!opened) throw ConfigError("--lcm-url", options.lcm_url, opened.error().message);
    bus_ = std::move(*opened);
    settings_.batch_bytes_max = bus_->batch_bytes_max();
    const bool has_page = !options.page.address.empty();
    if (has_page) {
      settings_.on_applied = [this](const learner::Run& run, int number) {
        page_->study().applied(run, number);
      };
    }
    core_ = std::make_unique<learner::LearnerCore>(loaded.study, settings_);
    if (has_page) open_page(loaded, directory);
  }

  ~LearnerDaemon() override {
    if (journal_) loop_.forget(journal_->sync_done());
  }
  LearnerDaemon(const LearnerDaemon&) = delete;
  LearnerDaemon& operator=(const LearnerDaemon&) = delete;

  /// Folds what the journal holds, and begins to write: of a study that is extended first what it
  /// becomes.
  void continue_journal(std::unique_ptr<JournalWriter> journal, const StateFiles& files,
                        const StateStudy& state) {
    journal_ = std::move(journal);
    loop_.watch(journal_->sync_done(), [this] { end_sync(); });
    const JournalTail tail = fold_state(files, state, loop_.now(), *core_, hooks_of_page());
    if (tail.torn_bytes > 0) {
      spdlog::warn("{}: cut off {} bytes{} that an interrupted learner left",
                   files.journal.string(), tail.torn_bytes,
                   tail.torn_bytes_are_zero ? ", all of them 0," : "");
    }
    do_resumably(files.directory, [&] { begin_journal(tail, files, state); });
  }

  void run() {
    loop_.on_signals(stop_signals(), [this](int signal) { stop(signal); });
    if (core_->outcome() != learner::LearnerCore::Outcome::kRunning) return finish();
    if (page_) spdlog::info("the page is {}", page_->url());
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
    show_the_end();
  }

  /// A clean end, once the results are written.
  void seal_journal() {
    journal_->append(JournalSeal{}, wall_time_us());
    journal_->sync();
  }

  const learner::LearnerCore& core() const { return *core_; }
  /// Once it is done.
  std::vector<RunRecord> take_results() { return std::move(*core_).run_records(); }

 private:
  void open_page(const LoadedStudy& loaded, const fs::path& directory) {
    web::StudyFacts facts{.program = program_version(),
                          .host_name = settings_.host,
                          .incarnation = std::to_string(settings_.learner_id),
                          .directory = directory.string(),
                          .columns = loaded.columns,
                          .demonstrations = loaded.demonstrations};
    page_.emplace(loop_, options_.page, *core_, std::move(facts),
                  showing_program(directory, options_.worker_program));
  }

  /// What the journal holds already is told as what is written to it.
  FoldHooks hooks_of_page() {
    if (!page_) return {};
    return {.after = [this](const JournalRecord& record) { tell(page_->study(), record); }};
  }

  void begin_journal(const JournalTail& tail, const StateFiles& files, const StateStudy& state) {
    journal_->continue_after(tail);
    journal_->append(JournalStart{.study_id = state.in_journal.id,
                                  .learner_id = settings_.learner_id,
                                  .program = cut_text(program_version(), kProgramBytesMax)},
                     wall_time_us());
    if (state.in_journal.is_before_extension) {
      journal_->append(write_extension(files, state, program_version()), wall_time_us());
    }
    journal_->sync();
  }

  void stop(int signal) {
    if (is_stopping_) return loop_.stop();
    spdlog::warn("{}: waits for the roll-outs under way; once more ends at once",
                 strsignal(signal));
    is_stopping_ = true;
    step(learner::StopRequested{});
  }

  void receive(protocol::Message message) {
    if (!std::exchange(answer_is_due_, true)) {
      loop_.after_ready_events([this] {
        answer_is_due_ = false;
        step(learner::InboxDrained{});
      });
    }
    if (const auto* status = std::get_if<protocol::WorkerStatus>(&message); status && page_) {
      page_->study().heard(*status, settings_.learner_id);
    }
    step(learner::MessageReceived{std::move(message)});
  }

  void watch_local_worker() {
    local_worker_->watch(loop_.now());
    restart_timer_.set(local_worker_->next_start());
  }

  /// Of the journal, or nothing more is done.
  template <class Action>
  void on_disk(const Action& action) {
    if (failure_) return;
    try {
      action();
    } catch (const std::runtime_error&) {
      fail();
    }
  }

  /// Meanwhile the learner goes on: a disk may take longer than its workers have work.
  void begin_sync() {
    is_unsynced_ = false;
    is_syncing_ = true;
    on_disk([this] { journal_->begin_sync(); });
    step(learner::SyncBegun{});
  }

  void end_sync() {
    is_syncing_ = false;
    on_disk([this] { journal_->end_sync(); });
    step(learner::JournalSynced{});
    if (is_unsynced_) plan_sync();
  }

  void plan_sync() {
    is_unsynced_ = true;
    if (!is_syncing_ && !sync_timer_.is_set()) {
      sync_timer_.set(loop_.now() + protocol::kSyncPeriod);
    }
  }

  /// Whoever watches asks twice a second: the last look shows how it ended, not the one before.
  void show_the_end() {
    if (!page_ || !page_->is_watched()) return;
    is_stopping_ = true;  // a signal ends it at once
    transport::Timer end(loop_, [this] { loop_.stop(); });
    end.set(loop_.now() + kLastLook);
    loop_.run();
  }

  void step(const learner::Event& event) {
    if (failure_) return;
    effects_.clear();
    core_->step(loop_.now(), event, effects_);
    on_disk([this] { learner::carry_out(effects_, *this); });
    if (failure_) return;
    if (core_->outcome() != learner::LearnerCore::Outcome::kRunning) {
      // Once: a loop that is stopped while nobody runs it would not run again.
      if (!std::exchange(has_ended_, true)) loop_.stop();
      return;
    }
    if (!answer_is_due_) core_timer_.set(core_->next_deadline());
  }

  void append(const AcceptedResult& result) override {
    write(result);
    if (page_) page_->study().accepted(result);
  }

  void append(const KnownWorker& worker) override {
    write(worker);
    if (page_) page_->study().accepted(worker);
  }

  void append(const LearningTime& time) override { write(time); }

  void write(const JournalRecord& record) {
    journal_->append(record, wall_time_us());
    plan_sync();
  }

  void flush() override { journal_->flush(); }

  void send(const protocol::Message& message) override {
    bus_->publish(message);
    if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
      progress_.show(*status, loop_.now());
      progress_.show(bus_->statistics(), loop_.now());
      if (page_) page_->study().note(*status, loop_.now());
    }
  }

  void log(const LogLine& line) override { log_line(line); }

  /// A learner that cannot write must not go on; called inside a catch.
  void fail() {
    failure_ = std::current_exception();
    loop_.stop();
  }

  /// What is left to write, and the last acknowledgements.
  void finish() {
    on_disk([this] { journal_->sync(); });
    step(learner::SyncBegun{});
    step(learner::JournalSynced{});
    if (failure_) std::rethrow_exception(failure_);
  }

  transport::Loop loop_;
  transport::Timer core_timer_{loop_, [this] { step(learner::TimerFired{}); }};
  transport::Timer sync_timer_{loop_, [this] { begin_sync(); }};
  transport::Timer restart_timer_{loop_, [this] { watch_local_worker(); }};
  learner::LearnerSettings settings_;
  const LearnerOptions& options_;
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
  end_when_stopped(kExitStopped, "asked to end while it was starting: nothing is lost\n");
  const bool resumes = !options.resume_dir.empty();
  StateFiles files;
  StateStudy state;
  std::unique_ptr<JournalWriter> journal;
  if (resumes) {
    // Locked first: what a study is, its journal says too.
    check_resumable(options.resume_dir);
    // Of a study that a later program has written nothing is touched.
    read_study_name(study_of(options.resume_dir));
    files = state_files(options.resume_dir);
    journal = std::make_unique<JournalWriter>(files.journal);
    if (options.salvage) salvage(files.journal);
    state = read_state_study(files, options.overrides);
  } else {
    state.loaded = load_study(options.study_file, options.overrides);
    files.directory = options.state_dir.empty()
                          ? fs::path("treeroll-runs") / state.loaded.study.name
                          : options.state_dir;
    files.journal = journal_of(files.directory);
  }
  LoadedStudy& loaded = state.loaded;
  learner::LearnerSettings settings;
  settings.learner_id = random_id();  // fresh: answers to an earlier incarnation cannot pass
  settings.host = host_name();
  settings.pid = getpid();
  const std::map<std::string, DescribedTask> tasks =
      survey_tasks(loaded, options.worker_program, options.needs_worker_program);
  settings.known_tasks = resumes ? descriptions_of(tasks) : resolve_tasks(loaded, tasks);
  const std::string resolved = resumes ? std::string() : loaded.resolved.to_toml(program_version());
  if (!resumes) check_state_directory(files.directory);

  LearnerDaemon daemon(loaded, settings, options, files.directory);
  if (!resumes) {
    make_directories_durably(files.directory);
    journal = std::make_unique<JournalWriter>(files.journal);
    check_state_directory(files.directory);  // again: another learner may have been faster
    // And the journal's name lasts.
    write_atomically(study_of(files.directory), resolved);
    state.in_journal = {study_id_of(files.directory), loaded.study.repetitions};
  }
  daemon.continue_journal(std::move(journal), files, state);
  spdlog::info("learner {}, study {}: {} conditions x {} repetitions, {} {}", settings.learner_id,
               loaded.study.name, loaded.study.conditions.size(), loaded.study.repetitions,
               resumes ? "goes on in" : "results go to", files.directory.string());
  if (!state.extension.empty()) spdlog::info("extended: {}", state.extension);
  log_fits(loaded);
  if (const std::string condition = unresolved_condition(loaded); !condition.empty()) {
    spdlog::warn(
        "condition {}: the study does not hold what its task makes of the settings, so that "
        "workers of other defaults are not noticed ({})",
        condition,
        resumes ? "it was begun without a worker program that knows the task, or by version 0.1.0"
                : "no worker program here knows the task: --worker-program");
  }
  if (resumes) {
    spdlog::info("{} roll-outs are in the journal", daemon.core().counters().applied);
  }

  const auto start = std::chrono::steady_clock::now();
  do_resumably(files.directory, [&] { daemon.run(); });
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<RunRecord> runs = daemon.take_results();
  if (runs.size() >= kManyRuns) {
    spdlog::info("writes the policies of {} runs to {}", runs.size(), files.directory.string());
  }
  const StudySummary summary{loaded.study.name,
                             summarize(runs, daemon.core().determinism()),
                             daemon.core().counters(),
                             daemon.core().worker_records(),
                             elapsed_s,
                             daemon.core().results_by_class()};
  do_resumably(files.directory, [&] {
    const std::string failures = write_results(files.directory, runs);
    if (!failures.empty()) throw std::runtime_error(failures);
    daemon.seal_journal();
  });
  // Last: whoever reads it may have gone, which is an error then.
  fmt::print("{}", options.json ? to_json(summary) + "\n" : to_table(summary.conditions));
  if (!options.json && summary.results_by_class.size() > 1) {
    fmt::print("numeric classes: {}: bits depend on who evaluated what\n",
               class_list(summary.results_by_class));
  }
  flush_standard_output();
  if (daemon.core().outcome() != learner::LearnerCore::Outcome::kDone) {
    spdlog::warn("stopped early with {} roll-outs; go on with --resume {}", summary.ledger.applied,
                 files.directory.string());
    return kExitStopped;
  }
  spdlog::info("done in {:.1f} s: {}", elapsed_s, files.directory.string());
  if (const std::string why = why_nothing_was_learnt(summary.conditions); !why.empty()) {
    spdlog::error("nothing was learnt: {}", why);
    return kExitNothingLearnt;
  }
  return kExitDone;
}

}  // namespace treeroll
