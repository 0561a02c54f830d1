#include "learner/app/learn.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <set>
#include <stdexcept>

#include "common/files/atomic_file.h"
#include "common/program/host_name.h"
#include "common/program/process_start.h"
#include "common/program/program.h"
#include "common/program/random_id.h"
#include "common/program/standard_output.h"
#include "learner/app/daemon.h"
#include "learner/app/resumable.h"
#include "learner/journal/journal_file.h"
#include "learner/journal/journal_origins.h"
#include "learner/results/recheck_text.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/state/state_study.h"
#include "learner/state/suspects.h"
#include "learner/study/study_file.h"
#include "learner/study/task_table.h"
#include "learner/worker_program/task_survey.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

/// Their files take seconds, which is said.
constexpr std::size_t kManyRuns = 300;

/// A study and where it is kept.
struct Opened {
  StateFiles files;
  StateStudy state;
  std::unique_ptr<JournalWriter> journal;  ///< of a study that goes on; a new one has none yet
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

Opened open_for_resuming(const LearnerOptions& options) {
  Opened opened;
  check_resumable(options.resume_dir);
  // Of a study that a later program has written nothing is touched.
  read_study_name(study_of(options.resume_dir));
  opened.files = state_files(options.resume_dir);
  // Locked before the study is read: what a study is, its journal says too.
  opened.journal = std::make_unique<JournalWriter>(opened.files.journal);
  if (options.salvage) salvage(opened.files.journal);
  opened.state = read_state_study(opened.files, options.overrides);
  return opened;
}

Opened open_new(const LearnerOptions& options) {
  Opened opened;
  opened.state.loaded = load_study(options.study_file, options.overrides);
  opened.files.directory = results_directory(options, opened.state.loaded.study.name);
  opened.files.journal = journal_of(opened.files.directory);
  return opened;
}

/// Writes what makes a directory that of this study.
void begin_directory(const std::string& resolved_study, Opened& opened) {
  const fs::path& directory = opened.files.directory;
  make_directories_durably(directory);
  opened.journal = std::make_unique<JournalWriter>(opened.files.journal);
  check_state_directory(directory);  // again: another learner may have been faster
  // And the journal's name lasts.
  write_atomically(study_of(directory), resolved_study);
  opened.state.in_journal = {study_id_of(directory), opened.state.loaded.study.repetitions};
}

void say_what_begins(const Opened& opened, const learner::LearnerCore& core, bool resumes,
                     std::int64_t learner_id) {
  const LoadedStudy& loaded = opened.state.loaded;
  spdlog::info("learner {}, study {}: {} conditions x {} repetitions, {} {}", learner_id,
               loaded.study.name, loaded.study.conditions.size(), loaded.study.repetitions,
               resumes ? "goes on in" : "results go to", opened.files.directory.string());
  if (!opened.state.extension.empty()) spdlog::info("extended: {}", opened.state.extension);
  log_fits(loaded);
  if (const std::string condition = unresolved_condition(loaded); !condition.empty()) {
    spdlog::warn(
        "condition {}: the study does not hold what its task makes of the settings, so that "
        "workers of other defaults are not noticed ({})",
        condition,
        resumes ? "it was begun without a worker program that knows the task, or by version 0.1.0"
                : "no worker program here knows the task: --worker-program");
  }
  if (resumes) spdlog::info("{} roll-outs are in the journal", core.counters().applied);
}

/// Writes the results; the journal is sealed once all are there.
StudySummary write_down(const Opened& opened, double elapsed_s, LearnerDaemon& daemon) {
  const fs::path& directory = opened.files.directory;
  const std::vector<RunRecord> runs = daemon.take_results();
  if (runs.size() >= kManyRuns) {
    spdlog::info("writes the policies of {} runs to {}", runs.size(), directory.string());
  }
  StudySummary summary{opened.state.loaded.study.name,
                       summarize(runs, daemon.core().determinism()),
                       daemon.core().counters(),
                       daemon.core().worker_records(),
                       elapsed_s,
                       daemon.core().results_by_class(),
                       daemon.core().workforce().rechecks().record()};
  do_resumably(directory, [&] {
    write_results(directory, runs);
    // Read anew: an extension is in the journal by now, and results follow it.
    write_suspects(opened.files, read_state_study(opened.files), summary.rechecks, directory);
    daemon.seal_journal();
  });
  return summary;
}

void print_summary(const StudySummary& summary, double rechecks_share, bool as_json) {
  fmt::print("{}", as_json ? to_json(summary) + "\n" : to_table(summary.conditions));
  if (!as_json && summary.results_by_class.size() > 1) {
    fmt::print("numeric classes: {}: bits depend on who evaluated what\n",
               class_list(summary.results_by_class));
  }
  if (!as_json) {
    for (const std::string& remark : remarks(summary.rechecks)) fmt::print("{}\n", remark);
    if (rechecks_share > 0 && summary.rechecks.num_rechecked == 0) {
      fmt::print(
          "study.recheck: no roll-out was run again: that takes a second worker, a task that "
          "gives one policy one reward, and some fifty roll-outs at a share of 0.02\n");
    }
  }
  flush_standard_output();
}

/// @return the exit status
int say_how_it_ended(const StudySummary& summary, const fs::path& directory, bool is_done) {
  if (!is_done) {
    spdlog::warn("stopped early with {} roll-outs; go on with --resume {}", summary.ledger.applied,
                 directory.string());
    return kExitStopped;
  }
  spdlog::info("done in {:.1f} s: {}", summary.elapsed_s, directory.string());
  if (const std::string why = why_nothing_was_learnt(summary.conditions); !why.empty()) {
    spdlog::error("nothing was learnt: {}", why);
    return kExitNothingLearnt;
  }
  return kExitDone;
}

}  // namespace

int run_learner(const LearnerOptions& options) {
  end_when_stopped(kExitStopped, "asked to end while it was starting: nothing is lost\n");
  const bool resumes = !options.resume_dir.empty();
  Opened opened = resumes ? open_for_resuming(options) : open_new(options);
  const fs::path& directory = opened.files.directory;
  LoadedStudy& loaded = opened.state.loaded;
  learner::LearnerSettings settings;
  settings.learner_id = random_id();  // fresh: answers to an earlier incarnation cannot pass
  settings.host = host_name();
  settings.pid = getpid();
  const std::map<std::string, DescribedTask> tasks =
      survey_tasks(loaded, options.worker_program, options.needs_worker_program);
  settings.known_tasks = resumes ? descriptions_of(tasks) : resolve_tasks(loaded, tasks);
  const std::string resolved = resumes ? std::string() : loaded.resolved.to_toml(program_version());
  if (!resumes) check_state_directory(directory);

  // Before there is a directory: of a bus that cannot be had no trace is left.
  LearnerDaemon daemon(loaded, settings, options, directory);
  if (!resumes) begin_directory(resolved, opened);
  daemon.continue_journal(std::move(opened.journal), opened.files, opened.state);
  say_what_begins(opened, daemon.core(), resumes, settings.learner_id);

  const auto start = std::chrono::steady_clock::now();
  do_resumably(directory, [&] { daemon.run(); });
  const double elapsed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const StudySummary summary = write_down(opened, elapsed_s, daemon);
  // Last: whoever reads it may have gone, which is an error then.
  print_summary(summary, loaded.study.recheck, options.json);
  return say_how_it_ended(summary, directory,
                          daemon.core().outcome() == learner::LearnerCore::Outcome::kDone);
}

}  // namespace treeroll
