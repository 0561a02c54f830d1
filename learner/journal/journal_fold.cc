#include "learner/journal/journal_fold.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "common/files/atomic_file.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

void check_same_study(const JournalStart& start, const ContentHash& study_id) {
  if (start.study_id != study_id) {
    throw std::runtime_error("the journal belongs to another study than study.toml");
  }
  if (start.algorithm_version != kAlgorithmVersion) {
    throw std::runtime_error(fmt::format(
        "the journal was written by version {} of the algorithm (treeroll {}), this is version {}: "
        "take that treeroll, or learn its study.toml anew",
        start.algorithm_version, start.format == 1 ? "0.1.0" : start.program, kAlgorithmVersion));
  }
}

/// One record more. Throws std::runtime_error if it does not follow from those before.
void fold(const JournalRecord& record, const ContentHash& study_id, TimePoint now,
          learner::LearnerCore& core) {
  if (const auto* start = std::get_if<JournalStart>(&record)) {
    return check_same_study(*start, study_id);
  }
  learner::Effects unsent;
  const auto* result = std::get_if<AcceptedResult>(&record);
  const auto* time = std::get_if<LearningTime>(&record);
  if (const auto* worker = std::get_if<KnownWorker>(&record)) {
    return core.step(now, learner::WorkerRecovered{*worker}, unsent);
  }
  if (!result && !time) return;
  if (core.outcome() == learner::LearnerCore::Outcome::kDone) {
    throw std::runtime_error("the journal goes on although every run has ended");
  }
  if (result) core.step(now, learner::ResultRecovered{*result}, unsent);
  if (time) core.step(now, learner::TimeRecovered{*time}, unsent);
  if (core.outcome() == learner::LearnerCore::Outcome::kFailed)
    throw std::runtime_error(core.failure());
}

fs::path free_name(const fs::path& journal) {
  for (int i = 1;; ++i) {
    fs::path name = journal;
    name += i == 1 ? ".damaged" : fmt::format(".damaged{}", i);
    if (!fs::exists(name)) return name;
  }
}

}  // namespace

JournalTail fold_journal(const fs::path& journal, const ContentHash& study_id, TimePoint now,
                         learner::LearnerCore& core,
                         const std::function<void(const JournalRecord&)>& on_record) {
  learner::Effects unsent;  // workers ask for definitions when they need them
  core.step(now, learner::Started{}, unsent);
  std::int64_t number = 0;
  std::uint64_t offset = 0;
  std::ifstream file(journal, std::ios::binary);
  if (!file) throw std::runtime_error(journal.string() + ": " + std::strerror(errno));
  const auto on_next = [&](const JournalRecord& record) {
    try {
      fold(record, study_id, now, core);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: record {} at byte {}: {}", journal.string(), number,
                                           offset, error.what()));
    }
    ++number;
    offset += framed_size(record);
    if (on_record) on_record(record);
  };
  const Result<JournalTail> tail = read_journal(file, journal.string(), on_next);
  if (!tail) {
    // What cannot be read may be whole.
    const char* advice =
        file.bad() ? "" : " (treeroll-learner --resume DIR --salvage keeps what is before)";
    throw std::runtime_error(tail.error().message + advice);
  }
  return *tail;
}

Salvaged salvage_journal(const fs::path& journal) {
  Salvaged salvaged;
  const Result<JournalTail> tail = read_journal(journal, [&](const JournalRecord& record) {
    salvaged.bytes_kept += framed_size(record);
    ++salvaged.num_records;
  });
  if (tail) return salvaged;
  salvaged.damage = tail.error().message;
  salvaged.bytes_lost = fs::file_size(journal) - salvaged.bytes_kept;
  salvaged.whole = free_name(journal);
  copy_durably(journal, salvaged.whole);
  fs::resize_file(journal, salvaged.bytes_kept);
  return salvaged;
}

}  // namespace treeroll
