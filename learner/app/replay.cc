#include "learner/app/replay.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "common/base/config_error.h"
#include "common/base/rollout_status.h"
#include "common/files/atomic_file.h"
#include "common/files/whole_file.h"
#include "common/program/standard_output.h"
#include "learner/journal/journal_fold.h"
#include "learner/results/csv.h"
#include "learner/results/state_directory.h"
#include "learner/results/summary.h"
#include "learner/study/study_file.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

struct Places {
  fs::path journal;
  fs::path study;
  fs::path directory;
};

Places find(const fs::path& path) {
  const fs::path directory = fs::is_directory(path) ? path : path.parent_path();
  const Places places{fs::is_directory(path) ? journal_of(path) : path, study_of(directory),
                      directory};
  if (!fs::is_regular_file(places.journal)) {
    throw ConfigError("PATH", path.string(), "must be a journal or a folder that holds one");
  }
  return places;
}

/// What a journal tells of itself, without its study.
struct Contents {
  std::int64_t num_results = 0;
  std::int64_t num_failed = 0;
  std::int64_t num_discarded = 0;             ///< trials that were void
  int num_seals = 0;                          ///< clean ends
  std::vector<protocol::LearnerId> learners;  ///< one after the other
  std::optional<LearningTime> time;           ///< the last noted
};

void count(const JournalRecord& record, Contents& contents) {
  if (const auto* start = std::get_if<JournalStart>(&record)) {
    contents.learners.push_back(start->learner_id);
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
std::optional<int> compare_results(const fs::path& directory, const std::vector<RunRecord>& runs) {
  const TemporaryFolder expected;
  if (const std::string failures = write_results(expected.path(), runs); !failures.empty()) {
    throw std::runtime_error(failures);
  }
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
  return agree ? std::optional(num_files) : std::nullopt;
}

void say(const Places& places, const JournalTail& tail, const Contents& contents) {
  fmt::print("journal    {}\nrecords    {}, {} bytes{}\nlearners   {}\nroll-outs  {}, {} failed\n",
             places.journal.string(), tail.num_records, tail.intact_bytes,
             tail.sealed           ? ", sealed"
             : tail.torn_bytes > 0 ? fmt::format(", then {} torn bytes", tail.torn_bytes)
                                   : ", not sealed: interrupted, or a learner is at work",
             contents.learners.size(), contents.num_results, contents.num_failed);
  if (contents.num_discarded > 0) fmt::print("discarded  {} trials\n", contents.num_discarded);
  if (contents.time) fmt::print("learning   {:.1f} s\n", to_seconds(contents.time->elapsed));
}

/// A text file, say: nothing in it is a record.
bool is_journal(const Places& places, const JournalTail& tail) {
  if (tail.num_records > 0) return true;
  spdlog::error("{}: is no journal: not one record is in its {} bytes", places.journal.string(),
                tail.torn_bytes);
  return false;
}

bool verify(const Places& places) {
  const LoadedStudy loaded = load_study(places.study, {});
  learner::LearnerCore core(loaded.study, learner::LearnerSettings{});
  Contents contents;
  JournalTail tail;
  try {
    tail = fold_journal(places.journal, content_hash(read_whole_file(places.study)), TimePoint{},
                        core, [&](const JournalRecord& record) { count(record, contents); });
  } catch (const std::runtime_error& error) {
    spdlog::error("{}", error.what());
    return false;
  }
  if (!is_journal(places, tail)) return false;
  say(places, tail, contents);
  fmt::print("verified   every draw and update is that of the study and the rewards\n");
  if (!tail.sealed && contents.num_seals > 0) {
    fmt::print("results    not compared: they are those of an earlier stop\n");
    return true;
  }
  if (!fs::exists(places.directory / "runs.csv")) {
    fmt::print("results    no files yet\n");
    return true;
  }
  const std::optional<int> num_files = compare_results(places.directory, core.run_records());
  if (num_files) fmt::print("results    {} files agree\n", *num_files);
  return num_files.has_value();
}

std::string line_of(const AcceptedResult& result, protocol::LearnerId learner, bool as_json) {
  const std::string_view status = name(result.outcome.status());
  if (!as_json) {
    return fmt::format("{},{},{},{},{:x},{:x},{}\n", result.key.run, result.key.number,
                       result.outcome.reward(), status,
                       static_cast<std::uint64_t>(result.worker_id),
                       static_cast<std::uint64_t>(learner), csv_field(result.outcome.reason()));
  }
  const nlohmann::ordered_json line{
      {"run", result.key.run},
      {"rollout", result.key.number},
      {"reward", result.outcome.reward()},
      {"status", status},
      {"worker", fmt::format("{:x}", static_cast<std::uint64_t>(result.worker_id))},
      {"learner", fmt::format("{:x}", static_cast<std::uint64_t>(learner))},
      {"reason", result.outcome.reason()}};
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

bool export_results(const Places& places, const ReplayOptions& options) {
  std::optional<AtomicFile> file;
  if (!options.output_file.empty()) file.emplace(options.output_file);
  const auto write = [&](const std::string& text) {
    if (file) return file->append(text);
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) {
      throw std::runtime_error("cannot write to standard output");
    }
  };
  const bool as_json = options.export_format == "jsonl";
  if (!as_json) write("run,rollout,reward,status,worker,learner,reason\n");
  protocol::LearnerId learner = 0;
  const Result<JournalTail> tail = read_journal(places.journal, [&](const JournalRecord& record) {
    if (const auto* start = std::get_if<JournalStart>(&record)) learner = start->learner_id;
    if (const auto* result = std::get_if<AcceptedResult>(&record)) {
      write(line_of(*result, learner, as_json));
    }
  });
  if (!tail) {
    spdlog::error("{}", tail.error().message);
    return false;
  }
  if (!is_journal(places, *tail)) return false;
  if (file) file->commit();
  return true;
}

bool summarize_journal(const Places& places) {
  Contents contents;
  const Result<JournalTail> tail =
      read_journal(places.journal, [&](const JournalRecord& record) { count(record, contents); });
  if (!tail) {
    spdlog::error("{}", tail.error().message);
    return false;
  }
  if (!is_journal(places, *tail)) return false;
  say(places, *tail, contents);
  if (!fs::exists(places.study)) return true;
  const LoadedStudy loaded = load_study(places.study, {});
  learner::LearnerCore core(loaded.study, learner::LearnerSettings{});
  try {
    fold_journal(places.journal, content_hash(read_whole_file(places.study)), TimePoint{}, core);
  } catch (const std::runtime_error& error) {
    spdlog::error("{}", error.what());
    return false;
  }
  fmt::print("\n{}", to_table(summarize(core.run_records())));
  return true;
}

}  // namespace

bool replay(const ReplayOptions& options) {
  const Places places = find(options.path);
  const bool agreed = options.verify                  ? verify(places)
                      : options.export_format.empty() ? summarize_journal(places)
                                                      : export_results(places, options);
  flush_standard_output();
  return agreed;
}

}  // namespace treeroll
