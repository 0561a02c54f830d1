#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/time.h"
#include "learner/core/learner_core.h"
#include "learner/journal/journal_file.h"

namespace treeroll {

/// The studies a journal was learnt under: the first, then what each extension made of it.
struct JournalStudies {
  std::optional<ContentHash> first;  ///< nothing in an empty journal
  std::vector<JournalExtension> extensions;

  std::optional<ContentHash> last() const {
    return extensions.empty() ? first : extensions.back().study_id;
  }
};
/// Throws std::runtime_error as fold_journal() does.
JournalStudies read_studies(const std::filesystem::path& journal);

/// How a journal knows a core's study.
struct StudyInJournal {
  ContentHash id;                ///< of its text
  std::int32_t repetitions = 1;  ///< of the study of that text
  /// The core's study is that of the text with an extension that the journal does not tell of yet.
  bool is_before_extension = false;
};

/// A record, with the numbers that runs have in a study of so many repetitions.
struct NumberedRecord {
  JournalRecord record;
  std::optional<std::int32_t> run_then = std::nullopt;  ///< of a result, if it was another
  bool is_of_earlier_study = false;                     ///< a result before an extension
  std::int64_t wall_time_us = 0;                        ///< when it was written, since 1970

  /// Of the evaluation of a policy: an extension may have asked anew.
  bool may_be_superseded(protocol::RolloutKey key) const {
    return is_of_earlier_study && key.number < 0;
  }
};

/// Reads a journal to its end, or to the record that extends this study; and on from there, as a
/// learner has written more. Throws as fold_journal() does, and with the record's place what
/// `on_record` throws as std::runtime_error, unless that is a std::system_error.
class NumberedReader {
 public:
  NumberedReader(std::filesystem::path journal, const StudyInJournal& study,
                 std::int32_t repetitions_now);
  ~NumberedReader();
  NumberedReader(const NumberedReader&) = delete;
  NumberedReader& operator=(const NumberedReader&) = delete;

  /// What has come since the last call. @return  the tail of all
  const JournalTail& read(const std::function<void(const NumberedRecord&)>& on_record);
  /// The study has been extended: what lies behind is not read.
  bool is_past() const;

 private:
  class Stages;
  std::filesystem::path journal_;
  StudyInJournal study_;
  std::int32_t repetitions_now_;
  JournalStudies studies_;
  std::unique_ptr<Stages> stages_;
  JournalTail tail_;
};
/// The same, once.
JournalTail read_numbered(const std::filesystem::path& journal, const StudyInJournal& study,
                          std::int32_t repetitions_now,
                          const std::function<void(const NumberedRecord&)>& on_record);

/// What is called with each record; each may be empty. Runs in it are numbered as in the core's
/// study.
struct FoldHooks {
  /// First: when it was written, us since 1970. For people; a wall clock may go backwards.
  std::function<void(std::int64_t wall_time_us)> at = {};
  std::function<void(const JournalRecord&)> before = {};  ///< it is applied
  std::function<void(const JournalRecord&)> after = {};
};

/// One record more for a core that has been given all before it. Throws std::runtime_error if it
/// does not follow from those.
void apply(const NumberedRecord& numbered, TimePoint now, learner::LearnerCore& core);

/// Brings a fresh core to where a journal ends, and on as the journal grows: fold_journal() says
/// how.
class JournalFold {
 public:
  /// Precondition: the core outlives it.
  JournalFold(const std::filesystem::path& journal, const StudyInJournal& study, TimePoint now,
              learner::LearnerCore& core, FoldHooks hooks = {});
  /// Applies what has come since the last call. @return  the tail of all
  const JournalTail& go_on(TimePoint now);
  /// The journal goes on with an extension of the core's study.
  bool is_past() const { return reader_.is_past(); }

 private:
  NumberedReader reader_;
  learner::LearnerCore& core_;
  FoldHooks hooks_;
};

/// Brings a fresh core to where a journal ends, or to the record that extends this study: every
/// result must answer the question that is drawn again at its place, so every perturbation and
/// every update is recomputed on the way. Of the studies before an extension the roll-outs count as
/// if the study had been the core's from the start; their final evaluations do not, unless the core
/// asks for the same.
/// Throws std::runtime_error that names the journal, and for a difference its first record. So does
/// a journal of another study.
JournalTail fold_journal(const std::filesystem::path& journal, const StudyInJournal& study,
                         TimePoint now, learner::LearnerCore& core, const FoldHooks& hooks = {});

/// What salvage has kept of a damaged journal.
struct Salvaged {
  std::int64_t num_records = 0;  ///< before the damage: kept
  std::uintmax_t bytes_kept = 0;
  std::uintmax_t bytes_lost = 0;
  std::string damage;           ///< what and where it was; empty: none, nothing was done
  std::filesystem::path whole;  ///< where the journal lies as it was
};

/// Copies a damaged journal aside (JOURNAL.damaged, .damaged2, ..) and keeps the part before the
/// damage. Throws std::runtime_error if it cannot. Precondition: the caller holds the journal's
/// lock (JournalWriter).
Salvaged salvage_journal(const std::filesystem::path& journal);

}  // namespace treeroll
