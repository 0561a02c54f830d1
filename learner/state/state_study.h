#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "learner/journal/journal_fold.h"
#include "learner/study/study_file.h"

namespace treeroll {

/// Where a state directory keeps what a study was before its extension number 1, 2, ...
std::filesystem::path earlier_study_of(const std::filesystem::path& directory, int extension);

/// Files of a state directory that say what is learnt and what came of it.
struct StateFiles {
  std::filesystem::path directory;
  std::filesystem::path journal;
};
/// Those of a directory, or of a journal beside its study.toml.
StateFiles state_files(const std::filesystem::path& path);

/// The study of a state directory, and how its journal knows it.
struct StateStudy {
  LoadedStudy loaded;  ///< as it is learnt from now on
  StudyInJournal in_journal;
  /// What `loaded` extends: nothing of the journal follows from it. Its text, and what has grown;
  /// empty unless in_journal.is_before_extension.
  std::string text_before;
  std::string extension;
  int num_extensions = 0;  ///< that the journal tells of
};

/// Reads study.toml, and the journal for the extensions it tells of. An extension is written in
/// this order: what the study was, study.toml, a record of the journal. So a journal that tells of
/// the study before is completed, not refused.
/// @param overrides  what the study is to grow to (study_extension.h); empty: nothing
/// Throws StudyError and ConfigError for bad input, std::runtime_error for a journal that is
/// damaged or belongs to another study.
StateStudy read_state_study(const StateFiles& files,
                            const std::vector<std::string>& overrides = {});

/// Folds the journal into a core of that study.
JournalTail fold_state(const StateFiles& files, const StateStudy& state, TimePoint now,
                       learner::LearnerCore& core, const FoldHooks& hooks = {});

/// How far a study has come whose learner is at work, stopped or killed; empty if every run has
/// ended. "626 of 4800 roll-outs are learnt and 3 of 8 runs have ended".
std::string what_is_missing(const Study& study, const std::vector<RunRecord>& runs);

/// Keeps the study as it was beside study.toml, then writes that anew.
/// Precondition: in_journal.is_before_extension.
/// @param program  version of the program that writes it
/// @return  the record for the journal, once a start stands in it
JournalExtension write_extension(const StateFiles& files, const StateStudy& state,
                                 const std::string& program);

/// Each study that the journal was learnt under before study.toml, folded by itself: its final
/// evaluations too are those of its policies, and each extends the one before.
/// Throws as read_state_study() and fold_journal() do. @return  what has grown, by extension
std::vector<std::string> verify_earlier_studies(const StateFiles& files, const StateStudy& state);

}  // namespace treeroll
