#include "learner/journal/journal_fold.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "common/files/atomic_file.h"
#include "common/protocol/limits.h"

namespace treeroll {
namespace {

namespace fs = std::filesystem;

void check_version(const JournalStart& start) {
  if (start.algorithm_version == kAlgorithmVersion) return;
  throw std::runtime_error(fmt::format(
      "the journal was written by version {} of the algorithm, this program has version {}, which "
      "gives other bits: go on with treeroll {}, or learn its study.toml anew",
      start.algorithm_version, kAlgorithmVersion, start.format == 1 ? "0.1.0" : start.program));
}

/// The run that this one is once each condition has more repetitions.
std::int32_t renumbered(std::int32_t run, std::int32_t repetitions_then, std::int32_t now) {
  if (run < 0 || repetitions_then == now) return run;
  const std::int64_t number = std::int64_t{run / repetitions_then} * now + run % repetitions_then;
  return static_cast<std::int32_t>(std::min<std::int64_t>(number, protocol::kRunsMax));
}

[[noreturn]] void refuse(const std::string& damage, const std::istream& file) {
  // What cannot be read may be whole.
  const char* advice =
      file.bad() ? "" : " (treeroll-learner --resume DIR --salvage keeps what is before)";
  throw std::runtime_error(damage + advice);
}

std::ifstream open_journal(const fs::path& journal) {
  std::ifstream file(journal, std::ios::binary);
  if (!file) throw std::runtime_error(journal.string() + ": " + std::strerror(errno));
  return file;
}

fs::path free_name(const fs::path& journal) {
  for (int i = 1;; ++i) {
    fs::path name = journal;
    name += i == 1 ? ".damaged" : fmt::format(".damaged{}", i);
    // A link that leads nowhere is taken too: it would be followed.
    if (fs::symlink_status(name).type() == fs::file_type::not_found) return name;
  }
}

}  // namespace

void apply(const NumberedRecord& numbered, TimePoint now, learner::LearnerCore& core) {
  const auto* worker = std::get_if<KnownWorker>(&numbered.record);
  const auto* second = std::get_if<SecondAnswer>(&numbered.record);
  const auto* result = std::get_if<AcceptedResult>(&numbered.record);
  const auto* time = std::get_if<LearningTime>(&numbered.record);
  const auto* signals = std::get_if<TaskSignals>(&numbered.record);
  // What was run again may be answered after the last run has ended.
  if ((result || time) && core.outcome() == learner::LearnerCore::Outcome::kDone) {
    throw std::runtime_error("the journal goes on although every run has ended");
  }
  learner::Effects unsent;
  if (worker) core.step(now, learner::WorkerRecovered{*worker}, unsent);
  if (signals) core.step(now, learner::SignalsRecovered{*signals}, unsent);
  if (second) {
    core.step(now,
              learner::SecondRecovered{*second, numbered.run_then,
                                       numbered.may_be_superseded(second->result.key)},
              unsent);
  }
  if (result) {
    core.step(now,
              learner::ResultRecovered{*result, numbered.run_then,
                                       numbered.may_be_superseded(result->key)},
              unsent);
  }
  if (time) core.step(now, learner::TimeRecovered{*time}, unsent);
  const bool must_fit = second || result || time || signals;
  if (must_fit && core.outcome() == learner::LearnerCore::Outcome::kFailed) {
    throw std::runtime_error(core.failure());
  }
}

/// Follows a journal through the studies that came before the one that is asked for.
class NumberedReader::Stages {
 public:
  /// @param studies  those of the journal
  Stages(const JournalStudies& studies, const StudyInJournal& study, std::int32_t repetitions_now)
      : study_(study),
        repetitions_now_(repetitions_now),
        stage_(studies.first.value_or(study.id)),
        is_there_(stage_ == study.id) {
    const bool is_known =
        is_there_ || std::any_of(studies.extensions.begin(), studies.extensions.end(),
                                 [&study](const JournalExtension& extension) {
                                   return extension.study_id == study.id;
                                 });
    if (!is_known) throw std::runtime_error(kOtherStudy);
    repetitions_ = is_there_ ? study.repetitions : studies.extensions.front().repetitions_before;
  }

  /// The record with the numbers that runs have now. Nothing if it lies behind an extension of the
  /// study. Throws std::runtime_error if the studies do not follow from each other.
  std::optional<NumberedRecord> next(const JournalRecord& record) {
    if (is_past_) return std::nullopt;
    NumberedRecord numbered{.record = record};
    if (const auto* start = std::get_if<JournalStart>(&record)) {
      check_version(*start);
      if (start->study_id != stage_) throw std::runtime_error(kOtherStudy);
    } else if (const auto* extension = std::get_if<JournalExtension>(&record)) {
      extend(*extension);
      if (is_past_) return std::nullopt;
    } else if (auto* result = std::get_if<AcceptedResult>(&numbered.record)) {
      renumber(*result, numbered);
    } else if (auto* second = std::get_if<SecondAnswer>(&numbered.record)) {
      renumber(second->result, numbered);
    }
    return numbered;
  }
  bool is_past() const { return is_past_; }

 private:
  void renumber(AcceptedResult& result, NumberedRecord& numbered) const {
    const std::int32_t then = result.key.run;
    result.key.run = renumbered(then, repetitions_, repetitions_now_);
    if (result.key.run != then) numbered.run_then = then;
    numbered.is_of_earlier_study = !is_there_ || study_.is_before_extension;
  }

  static constexpr const char* kOtherStudy = "the journal belongs to another study than study.toml";

  void extend(const JournalExtension& extension) {
    if (extension.study_id_before != stage_ || extension.repetitions_before != repetitions_) {
      throw std::runtime_error("an extension of another study than the one before it");
    }
    is_past_ = is_there_;
    if (is_past_) return;
    stage_ = extension.study_id;
    repetitions_ = extension.repetitions;
    is_there_ = stage_ == study_.id;
    if (is_there_ && repetitions_ != study_.repetitions) {
      throw std::runtime_error(fmt::format("an extension to {} repetitions, the study has {}",
                                           repetitions_, study_.repetitions));
    }
  }

  const StudyInJournal& study_;
  std::int32_t repetitions_now_;
  ContentHash stage_;             // the study that the records now belong to
  std::int32_t repetitions_ = 1;  // its
  bool is_there_ = false;         // it is study_
  bool is_past_ = false;          // study_ has been extended
};

JournalStudies read_studies(const fs::path& journal) {
  JournalStudies studies;
  std::ifstream file = open_journal(journal);
  const auto on_next = [&studies](const JournalRecord& record) {
    const auto* start = std::get_if<JournalStart>(&record);
    if (start && !studies.first) studies.first = start->study_id;
    const auto* extension = std::get_if<JournalExtension>(&record);
    if (extension) studies.extensions.push_back(*extension);
  };
  const Result<JournalTail> tail = read_journal(file, journal.string(), on_next);
  if (!tail) refuse(tail.error().message, file);
  return studies;
}

NumberedReader::NumberedReader(fs::path journal, const StudyInJournal& study,
                               std::int32_t repetitions_now)
    : journal_(std::move(journal)),
      study_(study),
      repetitions_now_(repetitions_now),
      studies_(read_studies(journal_)) {}

NumberedReader::~NumberedReader() = default;

bool NumberedReader::is_past() const { return stages_ && stages_->is_past(); }

const JournalTail& NumberedReader::read(
    const std::function<void(const NumberedRecord&)>& on_record) {
  std::ifstream file = open_journal(journal_);
  const auto on_next = [&](const JournalRecord& record, const RecordPlace& place) {
    try {
      if (!stages_) stages_ = std::make_unique<Stages>(studies_, study_, repetitions_now_);
      if (std::optional<NumberedRecord> numbered = stages_->next(record)) {
        numbered->wall_time_us = place.wall_time_us;
        on_record(*numbered);
      }
    } catch (const std::system_error&) {
      throw;  // of a file that `on_record` writes: no fault of the record's
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: record {} at byte {}: {}", journal_.string(),
                                           place.number, place.begin, error.what()));
    }
  };
  const Result<JournalTail> tail = read_journal_places(file, journal_.string(), on_next, tail_);
  if (!tail) refuse(tail.error().message, file);
  return tail_ = *tail;
}

JournalTail read_numbered(const fs::path& journal, const StudyInJournal& study,
                          std::int32_t repetitions_now,
                          const std::function<void(const NumberedRecord&)>& on_record) {
  return NumberedReader(journal, study, repetitions_now).read(on_record);
}

JournalFold::JournalFold(const fs::path& journal, const StudyInJournal& study, TimePoint now,
                         learner::LearnerCore& core, FoldHooks hooks)
    : reader_(journal, study, core.study().repetitions), core_(core), hooks_(std::move(hooks)) {
  learner::Effects unsent;  // workers ask for definitions when they need them
  core.step(now, learner::Started{}, unsent);
}

const JournalTail& JournalFold::go_on(TimePoint now) {
  return reader_.read([&](const NumberedRecord& numbered) {
    if (hooks_.at) hooks_.at(numbered.wall_time_us);
    if (hooks_.before) hooks_.before(numbered.record);
    apply(numbered, now, core_);
    if (hooks_.after) hooks_.after(numbered.record);
  });
}

JournalTail fold_journal(const fs::path& journal, const StudyInJournal& study, TimePoint now,
                         learner::LearnerCore& core, const FoldHooks& hooks) {
  return JournalFold(journal, study, now, core, hooks).go_on(now);
}

Salvaged salvage_journal(const fs::path& journal) {
  Salvaged salvaged;
  std::ifstream file = open_journal(journal);
  const Result<JournalTail> tail = read_journal_places(
      file, journal.string(), [&](const JournalRecord&, const RecordPlace& place) {
        salvaged.bytes_kept = place.end;
        salvaged.num_records = place.number + 1;
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
