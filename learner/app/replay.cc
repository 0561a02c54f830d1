#include "learner/app/replay.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "common/base/config_error.h"
#include "common/files/whole_file.h"
#include "common/program/standard_output.h"
#include "learner/app/export_messages.h"
#include "learner/app/export_rollouts.h"
#include "learner/app/replay_page.h"
#include "learner/app/replayed_policy.h"
#include "learner/app/shown_rollout.h"
#include "learner/app/without_workers.h"
#include "learner/journal/journal_fold.h"
#include "learner/journal/journal_origins.h"
#include "learner/results/recheck_text.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/state/state_study.h"
#include "learner/state/suspects.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

StateFiles find(const fs::path& path) {
  const StateFiles files = state_files(path);
  if (!fs::is_regular_file(files.journal)) {
    throw ConfigError("PATH", path.string(), "must be a journal or a folder that holds one");
  }
  return files;
}

/// An output replaces what has its name, and what is learnt is in these files alone.
void require_not_of_the_state(const StateFiles& files, const fs::path& output) {
  const auto refuse = [&](const fs::path& file) {
    std::error_code is_not_there;
    if (!fs::equivalent(output, file, is_not_there)) return;
    throw ConfigError("--output", output.string(),
                      fmt::format("must not be {}: what is learnt is in it", file.string()));
  };
  refuse(files.journal);
  refuse(study_of(files.directory));
  for (int extension = 1; fs::exists(earlier_study_of(files.directory, extension)); ++extension) {
    refuse(earlier_study_of(files.directory, extension));
  }
}

/// What a journal tells of itself, without its study.
struct Contents {
  std::int64_t num_results = 0;
  std::int64_t num_failed = 0;
  std::int64_t num_discarded = 0;  ///< trials that were void
  int num_seals = 0;               ///< clean ends
  std::uint32_t newest_form = 0;   ///< of its records
  int num_extensions = 0;
  std::vector<protocol::LearnerId> learners;  ///< one after the other
  std::optional<LearningTime> time;           ///< the last noted
  JournalOrigins origins;
};

void count(const JournalRecord& record, Contents& contents) {
  contents.origins.add(record);
  if (const auto* start = std::get_if<JournalStart>(&record)) {
    contents.learners.push_back(start->learner_id);
    contents.newest_form = std::max(contents.newest_form, start->format);
  } else if (const auto* time = std::get_if<LearningTime>(&record)) {
    contents.time = *time;
  } else if (const auto* result = std::get_if<AcceptedResult>(&record)) {
    if (result->outcome.is_discarded()) {
      ++contents.num_discarded;
      return;
    }
    ++contents.num_results;
    if (!result->outcome.is_ok()) ++contents.num_failed;
  } else if (std::holds_alternative<JournalSeal>(record)) {
    ++contents.num_seals;
  } else if (std::holds_alternative<JournalExtension>(record)) {
    ++contents.num_extensions;
  }
}

/// A folder of our own that is gone at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "treeroll-replay.XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) {
      throw std::runtime_error("cannot make a folder in " + fs::temp_directory_path().string());
    }
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// Compares the result files of a state directory with those of the fold.
/// @return how many agree; nothing if one does not, which is said
std::optional<int> compare_results(const StateFiles& files, const StateStudy& state,
                                   const RecheckRecord& rechecks,
                                   const std::vector<RunRecord>& runs) {
  const fs::path& directory = files.directory;
  const TemporaryFolder expected;
  write_suspects(files, state, rechecks, expected.path());
  write_results(expected.path(), runs);
  int num_files = 0;
  bool agree = true;
  for (const auto& entry : fs::recursive_directory_iterator(expected.path())) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), expected.path());
    if (!fs::exists(directory / name)) {
      spdlog::error("{}: is missing", (directory / name).string());
      agree = false;
    } else if (read_whole_file(directory / name) != read_whole_file(entry.path())) {
      spdlog::error("{}: differs from what the journal adds up to", (directory / name).string());
      agree = false;
    }
    ++num_files;
  }
  if (fs::exists(directory / "suspects.csv") && !fs::exists(expected.path() / "suspects.csv")) {
    spdlog::error("{}: differs: the journal has no suspects",
                  (directory / "suspects.csv").string());
    agree = false;
  }
  return agree ? std::optional(num_files) : std::nullopt;
}

/// What a learner writes before it seals its journal.
bool has_results(const fs::path& directory) {
  return fs::exists(directory / "runs.csv") || fs::exists(directory / "rollouts.csv") ||
         fs::exists(directory / "policies");
}

void say(const StateFiles& files, const JournalTail& tail, const Contents& contents) {
  fmt::print("journal    {}\nrecords    {}, {} bytes{}\nlearners   {}\nroll-outs  {}, {} failed\n",
             files.journal.string(), tail.num_records, tail.intact_bytes,
             tail.sealed           ? ", sealed"
             : tail.torn_bytes > 0 ? fmt::format(", then {} torn bytes", tail.torn_bytes)
                                   : ", not sealed: interrupted, or a learner is at work",
             contents.learners.size(), contents.num_results, contents.num_failed);
  fmt::print("programs   treeroll {}\n", fmt::join(contents.origins.programs(), ", "));
  if (contents.num_results > 0) {
    fmt::print("classes    {}\n", class_list(contents.origins.results_by_class()));
  }
  if (contents.num_discarded > 0) {
    fmt::print("discarded  {} trials, those that were given up too\n", contents.num_discarded);
  }
  if (contents.time) fmt::print("learning   {:.1f} s\n", to_seconds(contents.time->elapsed));
  if (contents.num_extensions > 0) fmt::print("extended   {} times\n", contents.num_extensions);
}

void say(const RecheckRecord& rechecks) {
  for (const std::string& remark : remarks(rechecks)) fmt::print("run again  {}\n", remark);
}

/// A text file, say: nothing in it is a record.
void require_journal(const StateFiles& files, const JournalTail& tail) {
  if (tail.num_records > 0) return;
  throw std::runtime_error(fmt::format("{}: is no journal: not one record is in its {} bytes",
                                       files.journal.string(), tail.torn_bytes));
}

/// Compares the start policies that the study holds with what a fit gives now.
/// @return how many were fitted; nothing if one differs, which is said
std::optional<int> compare_starts(const StateFiles& files, const LoadedStudy& stored) {
  const LoadedStudy fitted =
      load_resolved_study(study_of(files.directory), {}, StoredStarts::kFittedAgain);
  int num_fits = 0;
  bool agree = true;
  for (std::size_t i = 0; i < stored.study.conditions.size(); ++i) {
    if (!stored.demonstrations[i]) continue;
    ++num_fits;
    if (to_json(*stored.study.conditions[i].start) == to_json(*fitted.study.conditions[i].start) &&
        stored.log_likelihoods[i] == fitted.log_likelihoods[i]) {
      continue;
    }
    spdlog::error("{}: condition {} starts from another policy than a fit gives",
                  study_of(files.directory).string(), stored.study.conditions[i].name);
    agree = false;
  }
  return agree ? std::optional(num_fits) : std::nullopt;
}

void say_missing(const Study& study, const std::vector<RunRecord>& runs, const StateFiles& files) {
  const std::string missing = what_is_missing(study, runs);
  if (missing.empty()) return;
  fmt::print("missing    {}: treeroll-learner --resume {} goes on\n", missing,
             files.directory.string());
}

bool verify(const StateFiles& files, bool refit) {
  const StateStudy state = read_state_study(files);
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  Contents contents;
  const JournalTail tail =
      fold_state(files, state, TimePoint{}, core,
                 {.after = [&](const JournalRecord& record) { count(record, contents); }});
  require_journal(files, tail);
  say(files, tail, contents);
  for (const std::string& extension : verify_earlier_studies(files, state)) {
    fmt::print("extension  {}\n", extension);
  }
  fmt::print("verified   every draw and update is that of the study and the rewards\n");
  if (refit) {
    const std::optional<int> num_fits = compare_starts(files, state.loaded);
    if (!num_fits) return false;
    fmt::print("starts     {} fits give what the study holds\n", *num_fits);
  }
  const RecheckRecord rechecks = core.workforce().rechecks().record();
  say(rechecks);
  const std::vector<RunRecord> runs = std::move(core).run_records();
  say_missing(state.loaded.study, runs, files);
  if (state.in_journal.is_before_extension) {
    fmt::print("results    not compared: an extension is not finished\n");
    return true;
  }
  if (!tail.sealed && contents.num_seals > 0) {
    fmt::print("results    not compared: they are those of an earlier stop\n");
    return true;
  }
  if (!tail.sealed && !has_results(files.directory)) {
    fmt::print("results    no files yet\n");
    return true;
  }
  if (contents.newest_form == 1) {
    fmt::print("results    not compared: files of an earlier version\n");
    return true;
  }
  const std::optional<int> num_files = compare_results(files, state, rechecks, runs);
  if (num_files) fmt::print("results    {} files agree\n", *num_files);
  return num_files.has_value();
}

void summarize_journal(const StateFiles& files) {
  Contents contents;
  const Result<JournalTail> tail =
      read_journal(files.journal, [&](const JournalRecord& record) { count(record, contents); });
  if (!tail) throw std::runtime_error(tail.error().message);
  require_journal(files, *tail);
  say(files, *tail, contents);
  if (!fs::exists(study_of(files.directory))) {
    fmt::print("study      none beside it: what was learnt and run again is not told\n");
    return;
  }
  const StateStudy state = read_state_study(files);
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  fold_state(files, state, TimePoint{}, core);
  say(core.workforce().rechecks().record());
  const std::vector<RunRecord> runs = std::move(core).run_records();
  say_missing(state.loaded.study, runs, files);
  fmt::print("\n{}", to_table(summarize(runs, determinism_of(state.loaded.study))));
}

void write_results_so_far(const StateFiles& files, const fs::path& directory) {
  require_new_directory("--results", directory);
  const StateStudy state = read_state_study(files);
  learner::LearnerCore core(state.loaded.study, learner::LearnerSettings{});
  require_journal(files, fold_state(files, state, TimePoint{}, core));
  fs::create_directories(directory);
  write_suspects(files, state, core.workforce().rechecks().record(), directory);
  const std::vector<RunRecord> runs = std::move(core).run_records();
  write_results(directory, runs);
  say_missing(state.loaded.study, runs, files);
}

}  // namespace

bool replay(const ReplayOptions& options) {
  const bool has_output = !options.export_format.empty() || !options.rollout.empty() ||
                          !options.start.empty() || !options.shown.empty();
  if (!options.output_file.empty() && !has_output) {
    throw ConfigError("--output", options.output_file.string(),
                      "must stand beside --export, --policy, --show or --start");
  }
  const StateFiles files = find(options.path);
  if (!options.output_file.empty()) require_not_of_the_state(files, options.output_file);
  if (options.export_format == "lcm" && options.output_file.empty() && isatty(STDOUT_FILENO) == 1) {
    throw ConfigError("--output", "", "must name a file: a log is nothing for a terminal");
  }
  bool agreed = true;
  if (options.verify) {
    agreed = verify(files, options.refit);
  } else if (options.export_format == "lcm") {
    export_messages(files, options.output_file);
  } else if (!options.export_format.empty()) {
    export_rollouts(files, options.export_format == "jsonl", options.output_file);
  } else if (!options.rollout.empty()) {
    write_policy_of_rollout(files, options.rollout, options.output_file);
  } else if (!options.page.address.empty()) {
    serve_journal(files, options.page, options.worker_program);
  } else if (!options.shown.empty()) {
    show_rollout(files, options.shown, options.worker_program, options.output_file);
  } else if (!options.start.empty()) {
    write_start_policy(files, options.start, options.output_file);
  } else if (!options.without_workers.empty()) {
    fold_without_workers(files, options.without_workers, options.new_state_dir);
  } else if (!options.results_dir.empty()) {
    write_results_so_far(files, options.results_dir);
  } else {
    summarize_journal(files);
  }
  flush_standard_output();
  return agreed;
}

}  // namespace treeroll
