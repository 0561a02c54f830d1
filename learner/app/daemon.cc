#include "learner/app/daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>

#include "common/base/config_error.h"
#include "common/base/cut_text.h"
#include "common/program/log.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "common/protocol/timings.h"
#include "learner/app/resumable.h"
#include "learner/app/showing.h"
#include "learner/app/told_record.h"
#include "learner/study/study_error.h"
#include "learner/study/task_table.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;
using transport::Channel;

/// The results of a study, on a disk that is slow.
constexpr std::chrono::hours kWritingMax{1};

constexpr Duration kLastLook = std::chrono::milliseconds(1500);

/// The earliest form that holds all that a study may have: what nobody here knows of a task, its
/// workers may tell.
std::uint32_t journal_format_of(const LoadedStudy& loaded) {
  if (!unresolved_condition(loaded).empty()) return kJournalFormat;
  return loaded.study.recheck > 0 ? kRecheckJournalFormat : kCommonJournalFormat;
}

/// Whether roll-outs of a task move something that a person may have to watch.
bool has_trials_of_things(const std::map<std::string, TaskDescription>& tasks) {
  return std::ranges::any_of(tasks, [](const auto& task) { return !task.second.repeatable; });
}

}  // namespace

LearnerDaemon::LearnerDaemon(const LoadedStudy& loaded, learner::LearnerSettings settings,
                             const LearnerOptions& options, const fs::path& directory)
    : settings_(std::move(settings)),
      options_(options),
      progress_(options.local_workers > 0 && has_trials_of_things(settings_.known_tasks)) {
  transport::BusOptions bus;
  bus.url = options.lcm_url;
  bus.channels = {Channel::kRewardBatch, Channel::kWorkerStatus, Channel::kDefinitionRequest,
                  Channel::kDefinitionReport};
  bus.among_programs = true;
  bus.key_file = transport::key_file_of("--key-file", options.key_file, transport::Voice::kLearner);
  trust_ = transport::trust_in_words(bus.key_file);
  bus.on_message = [this](protocol::Message message) { receive(std::move(message)); };
  Result<std::unique_ptr<transport::Bus>> opened = open_bus(loop_, std::move(bus));
  if (!opened) throw std::runtime_error(opened.error().message);
  bus_ = std::move(*opened);
  settings_.batch_bytes_max = bus_->batch_bytes_max();
  settings_.word_bytes = bus_->word_bytes();
  settings_.is_authenticated = !options.key_file.empty();
  const bool has_page = !options.page.address.empty();
  if (has_page) {
    settings_.on_applied = [this](const learner::Run& run, int number) {
      page_->study().applied(run, number);
    };
  }
  core_ = std::make_unique<learner::LearnerCore>(loaded.study, settings_);
  if (has_page) open_page(loaded, directory);
}

LearnerDaemon::~LearnerDaemon() {
  if (journal_) loop_.forget(journal_->sync_done());
}
void LearnerDaemon::continue_journal(std::unique_ptr<JournalWriter> journal,
                                     const StateFiles& files, const StateStudy& state) {
  journal_ = std::move(journal);
  loop_.watch(journal_->sync_done(), [this] { end_sync(); });
  const JournalTail tail = fold_state(files, state, loop_.now(), *core_, hooks_of_page());
  if (tail.torn_bytes > 0) {
    spdlog::warn("{}: cut off {} bytes{} that an interrupted learner left", files.journal.string(),
                 tail.torn_bytes, tail.torn_bytes_are_zero ? ", all of them 0," : "");
  }
  if (state.in_journal.is_before_extension && core_->time_is_up()) {
    throw StudyError(kCommandLineOrigin,
                     ConfigError("study.stop_after_s", "",
                                 "must be more as well: the study has had its time, and learns "
                                 "nothing of what is asked for besides"));
  }
  do_resumably(files.directory, [&] { begin_journal(tail, files, state); });
}

void LearnerDaemon::run() {
  manager_.say_ready();  // of a study that is done too: else its service would have failed to start
  loop_.on_signals(stop_signals(), [this](int signal) { stop(signal); });
  if (core_->outcome() != learner::LearnerCore::Outcome::kRunning) return finish();
  spdlog::info("{}", trust_);
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

void LearnerDaemon::seal_journal() {
  journal_->append(JournalSeal{}, wall_time_now_us());
  journal_->sync();
}

void LearnerDaemon::open_page(const LoadedStudy& loaded, const fs::path& directory) {
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
FoldHooks LearnerDaemon::hooks_of_page() {
  if (!page_) return {};
  return {.after = [this](const JournalRecord& record) { tell(page_->study(), record); }};
}

void LearnerDaemon::begin_journal(const JournalTail& tail, const StateFiles& files,
                                  const StateStudy& state) {
  journal_->continue_after(tail);
  journal_->append(JournalStart{.study_id = state.in_journal.id,
                                .learner_id = settings_.learner_id,
                                .format = journal_format_of(state.loaded),
                                .program = cut_text(program_version(), kProgramBytesMax)},
                   wall_time_now_us());
  if (state.in_journal.is_before_extension) {
    journal_->append(write_extension(files, state, program_version()), wall_time_now_us());
  }
  journal_->sync();
}

void LearnerDaemon::stop(int signal) {
  if (is_stopping_) {
    step(learner::StopRequested{});
    return loop_.stop();
  }
  spdlog::warn("{}: waits for the roll-outs under way; once more for none", strsignal(signal));
  is_stopping_ = true;
  manager_.say_stopping();
  manager_.say_busy_for(kWritingMax);  // runs that wait for a layer begin it before the results
  step(learner::StopRequested{});
}

void LearnerDaemon::receive(protocol::Message message) {
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

void LearnerDaemon::watch_local_worker() {
  local_worker_->watch(loop_.now());
  restart_timer_.set(local_worker_->next_start());
}

/// Of the journal, or nothing more is done.
template <class Action>
void LearnerDaemon::on_disk(const Action& action) {
  if (failure_) return;
  try {
    action();
  } catch (const std::runtime_error&) {
    fail();
  }
}

/// Meanwhile the learner goes on: a disk may take longer than its workers have work.
void LearnerDaemon::begin_sync() {
  is_unsynced_ = false;
  is_syncing_ = true;
  on_disk([this] { journal_->begin_sync(); });
  step(learner::SyncBegun{});
}

void LearnerDaemon::end_sync() {
  is_syncing_ = false;
  on_disk([this] { journal_->end_sync(); });
  step(learner::JournalSynced{});
  if (is_unsynced_) plan_sync();
}

void LearnerDaemon::plan_sync() {
  is_unsynced_ = true;
  if (!is_syncing_ && !sync_timer_.is_set()) {
    sync_timer_.set(loop_.now() + protocol::kSyncPeriod);
  }
}

/// Whoever watches asks twice a second: the last look shows how it ended, not the one before.
void LearnerDaemon::show_the_end() {
  if (!page_ || !page_->is_watched()) return;
  is_stopping_ = true;  // a signal ends it at once
  transport::Timer end(loop_, [this] { loop_.stop(); });
  end.set(loop_.now() + kLastLook);
  loop_.run();
}

void LearnerDaemon::step(const learner::Event& event) {
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

void LearnerDaemon::append(const AcceptedResult& result) {
  write(result);
  if (page_) page_->study().accepted(result);
}

void LearnerDaemon::append(const SecondAnswer& answer) { write(answer); }

void LearnerDaemon::append(const KnownWorker& worker) {
  write(worker);
  if (page_) page_->study().accepted(worker);
}

void LearnerDaemon::append(const TaskSignals& signals) { write(signals); }

void LearnerDaemon::append(const LearningTime& time) { write(time); }

void LearnerDaemon::write(const JournalRecord& record) {
  journal_->append(record, wall_time_now_us());
  plan_sync();
}

void LearnerDaemon::flush() { journal_->flush(); }

void LearnerDaemon::send(const protocol::Message& message) {
  bus_->publish(message);
  if (const auto* status = std::get_if<protocol::LearnerStatus>(&message)) {
    progress_.show(*status, loop_.now());
    manager_.say_status(how_far(*status));
    progress_.show(bus_->statistics(), loop_.now());
    if (page_) page_->study().note(*status, loop_.now());
  }
}

void LearnerDaemon::log(const LogLine& line) { log_line(line); }

/// A learner that cannot write must not go on; called inside a catch.
void LearnerDaemon::fail() {
  failure_ = std::current_exception();
  loop_.stop();
}

/// What is left to write, and the last acknowledgements.
void LearnerDaemon::finish() {
  manager_.say_busy_for(kWritingMax);
  on_disk([this] { journal_->sync(); });
  step(learner::SyncBegun{});
  step(learner::JournalSynced{});
  if (failure_) std::rethrow_exception(failure_);
}

}  // namespace treeroll
