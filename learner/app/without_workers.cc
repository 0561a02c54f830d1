#include "learner/app/without_workers.h"

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <set>
#include <stdexcept>

#include "common/base/config_error.h"
#include "common/base/shown_reward.h"
#include "common/files/atomic_file.h"
#include "common/files/whole_file.h"
#include "learner/journal/journal_refold.h"
#include "learner/results/recheck_text.h"
#include "learner/results/run_counts.h"
#include "learner/results/state_directory.h"
#include "learner/state/suspects.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWithoutOption = "--without-worker";
constexpr const char* kSuspects = "suspects";
/// More runs are summed up.
constexpr std::size_t kRunsSaidMax = 40;
/// They are written once they are so many.
constexpr std::int64_t kRecordsAtOnce = 4096;

/// Whose answers the journal holds, first or second ones.
std::set<protocol::WorkerId> workers_in(const fs::path& journal) {
  std::set<protocol::WorkerId> workers;
  const Result<JournalTail> tail = read_journal(journal, [&](const JournalRecord& record) {
    if (const auto* first = std::get_if<AcceptedResult>(&record)) workers.insert(first->worker_id);
    if (const auto* second = std::get_if<SecondAnswer>(&record)) {
      workers.insert(second->result.worker_id);
    }
  });
  if (!tail) throw std::runtime_error(tail.error().message);
  return workers;
}

std::set<protocol::WorkerId> read_workers(const std::vector<std::string>& words,
                                          const StateFiles& files, const RecheckRecord& rechecks) {
  const std::set<protocol::WorkerId> known = workers_in(files.journal);
  std::set<protocol::WorkerId> workers;
  for (const std::string& word : words) {
    if (word == kSuspects) {
      workers.merge(suspects_of(rechecks));
      if (!workers.empty()) continue;
      throw ConfigError(kWithoutOption, word, "no worker of this journal was outvoted by others");
    }
    protocol::WorkerId id = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), id);
    if (error != std::errc{} || end != word.data() + word.size()) {
      throw ConfigError(kWithoutOption, word, "must be the id of a worker, or suspects");
    }
    if (!known.contains(id)) {
      throw ConfigError(kWithoutOption, word,
                        "must be a worker with answers in the journal: --export csv lists them");
    }
    workers.insert(id);
  }
  return workers;
}

/// Everything that says what is learnt, byte for byte: the journal knows it by its hash.
void copy_studies(const StateFiles& from, int num_extensions, const fs::path& to) {
  make_directories_durably(to);
  for (int i = 1; i <= num_extensions; ++i) {
    write_atomically(earlier_study_of(to, i), read_whole_file(earlier_study_of(from.directory, i)));
  }
  write_atomically(study_of(to), read_whole_file(study_of(from.directory)));
}

/// What was written is read: it must fold as any journal does.
std::vector<RunRecord> write_results_of(const StateFiles& files) {
  const StateStudy state = read_state_study(files);
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  fold_state(files, state, TimePoint{}, core);
  write_suspects(files, state, core.workforce().rechecks().record(), files.directory);
  std::vector<RunRecord> runs = std::move(core).run_records();
  write_results(files.directory, runs);
  return runs;
}

/// Writes the journal of what remains.
Refold::Counts write_journal(const StateFiles& from, const StateStudy& state,
                             const std::set<protocol::WorkerId>& workers, JournalWriter& journal,
                             std::set<std::int32_t>& changed_runs) {
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  learner::Effects unsent;
  core.step(TimePoint{}, learner::Started{}, unsent);
  Refold refold(core, workers);
  const auto read = [&](const auto& on_record) {
    read_numbered(from.journal, state.in_journal, state.loaded.study.repetitions, on_record);
  };
  std::int64_t num_records = 0;
  read([&](const NumberedRecord& numbered) { refold.read_ahead(numbered); });
  read([&](const NumberedRecord& numbered) {
    for (const JournalRecord& record : refold.next(numbered, TimePoint{})) {
      journal.append(record, wall_time_now_us());
      if (++num_records % kRecordsAtOnce == 0) journal.flush();
    }
  });
  journal.sync();
  changed_runs = refold.changed_runs();
  return refold.counts();
}

void say_runs(const std::vector<RunRecord>& before, const std::vector<RunRecord>& after,
              const std::set<std::int32_t>& changed) {
  std::size_t num_said = 0;
  for (const std::int32_t run : changed) {
    if (++num_said > kRunsSaidMax) break;
    const RunRecord& then = before[static_cast<std::size_t>(run)];
    const RunRecord& now = after[static_cast<std::size_t>(run)];
    const auto best = [](const RunRecord& record) {
      return record.best_rollout < 0 ? std::string("-") : shown_reward(record.best_reward);
    };
    fmt::print("run {:<6} {}, repetition {}: {} roll-outs, best {}; before {}, best {}\n", run,
               now.condition, now.repetition, num_applied(now), best(now), num_applied(then),
               best(then));
  }
  if (changed.size() > kRunsSaidMax) {
    fmt::print("           {} more runs have changed\n", changed.size() - kRunsSaidMax);
  }
}

}  // namespace

void fold_without_workers(const StateFiles& files, const std::vector<std::string>& words,
                          const fs::path& directory) {
  require_new_directory("--state-dir", directory);
  const StateStudy state = read_state_study(files);
  if (state.in_journal.is_before_extension) {
    throw std::runtime_error(
        fmt::format("{}: an extension is not finished: treeroll-learner --resume it first",
                    files.directory.string()));
  }
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  fold_state(files, state, TimePoint{}, core);
  const std::set<protocol::WorkerId> workers =
      read_workers(words, files, core.workforce().rechecks().record());
  const std::vector<RunRecord> before = std::move(core).run_records();

  copy_studies(files, state.num_extensions, directory);
  const StateFiles to{directory, journal_of(directory)};
  JournalWriter journal(to.journal);
  journal.continue_after(JournalTail{});
  std::set<std::int32_t> changed;
  const Refold::Counts counts = write_journal(files, state, workers, journal, changed);
  const std::vector<RunRecord> after = write_results_of(to);
  journal.append(JournalSeal{}, wall_time_now_us());
  journal.sync();

  for (const protocol::WorkerId worker : workers) fmt::print("without    worker {}\n", worker);
  fmt::print("left out   {} results of these; another worker's answer has taken the place of {}\n",
             counts.num_left_out, counts.num_replaced);
  fmt::print("besides    {} results of others that followed from them; {} are kept\n",
             counts.num_following, counts.num_kept);
  say_runs(before, after, changed);
  const std::string missing = what_is_missing(state.loaded.study, after);
  if (!missing.empty()) {
    fmt::print(
        "missing    {}: treeroll-learner --resume {} learns them again; end these workers first, "
        "or it gives them work again\n",
        missing, directory.string());
  }
}

}  // namespace treeroll
